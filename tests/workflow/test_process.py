"""Which features count in a project: templates, switches, own features, and what they do to coverage and questions."""

from typing import Any

import pytest

from app.errors import InvalidFeature, InvalidInput, UnknownFeature
from app.workflow import coverage, policies, process, projects, runs, tools
from app.workflow.context import Context

OWN = """KEY, LABEL = "small_first", "Small regions first"


def values(graph, done):
    return (1 - graph.area / graph.area.max()) + 0 * done
"""


@pytest.fixture
def project(ctx: Context) -> dict[str, Any]:
    return projects.create_sample_project(ctx)


def put(ctx: Context, name: str, text: str) -> None:
    folder = ctx.settings.data / "features"
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")


def test_a_template_switches_features_and_interactions(ctx: Context, project: dict[str, Any]) -> None:
    before = coverage.get_coverage(ctx, project["id"])
    seen = process.set_process(ctx, project["id"], {"template": "spraying"})
    off = {f["key"] for f in seen["features"] if not f["on"]}
    assert (seen["template"], off, seen["levels"]) == ("spraying", {"orientation"}, "range")
    assert seen["feature_set"] == "clean~orientation"
    assert [i["first"] + " " + i["second"] for i in seen["interactions"]] == ["height curvature", "height jump"]
    after = coverage.get_coverage(ctx, project["id"])
    assert [t["label"] for t in after["tables"]] != [t["label"] for t in before["tables"]]
    assert projects.get_project(ctx, project["id"])["process"] == "Spraying"


def test_switching_a_feature_off_takes_its_interactions_away(ctx: Context, project: dict[str, Any]) -> None:
    seen = process.set_process(ctx, project["id"], {"without": ["curvature"]})
    assert seen["interactions"] == []
    with pytest.raises(UnknownFeature, match="no_such"):
        process.set_process(ctx, project["id"], {"without": ["no_such"]})
    with pytest.raises(InvalidInput, match="At least one"):
        process.set_process(ctx, project["id"], {"without": [f["key"] for f in seen["features"]]})
    assert process.get_process(ctx, project["id"])["feature_set"] == "clean~curvature"


def test_an_own_feature_shows_up_and_can_be_suspected(ctx: Context, project: dict[str, Any]) -> None:
    put(ctx, "small_first.py", OWN)
    listed = process.get_process(ctx, project["id"])["own"]
    assert [(o["file"], o["key"], o["on"], o["faults"]) for o in listed] == [("small_first.py", "small_first", False, [])]
    seen = process.set_process(ctx, project["id"], {"own": ["small_first"]})
    assert seen["own"][0]["on"]
    coverage.set_interactions(ctx, project["id"], [{"first": "small_first", "second": "curvature"}])
    assert "small regions first" in coverage.get_coverage(ctx, project["id"])["tables"][0]["label"].lower()


def test_a_changed_file_leaves_the_feature_in_use_as_it_was(ctx: Context, project: dict[str, Any]) -> None:
    put(ctx, "small_first.py", OWN)
    first = process.set_process(ctx, project["id"], {"own": ["small_first"]})["own"][0]["version"]
    put(ctx, "small_first.py", OWN.replace("1 - ", ""))
    listed = process.get_process(ctx, project["id"])["own"]
    assert [(o["file"], o["on"], o["version"] == first) for o in listed] == [("small_first.py", False, False), (None, True, True)]


def test_a_feature_that_breaks_the_contract_is_refused_in_words(ctx: Context, project: dict[str, Any]) -> None:
    put(ctx, "wide.py", OWN.replace("(1 - graph", "(3 - graph"))
    put(ctx, "broken.py", "KEY = 1")
    listed = {o["file"]: o["faults"] for o in process.get_process(ctx, project["id"])["own"]}
    assert "between 0 and 1" in listed["wide.py"][0]
    assert "needs KEY" in listed["broken.py"][0]
    with pytest.raises(InvalidFeature, match="between 0 and 1"):
        process.set_process(ctx, project["id"], {"own": ["small_first"]})
    with pytest.raises(UnknownFeature, match="defines a feature 'other'"):
        process.set_process(ctx, project["id"], {"own": ["other"]})


def test_a_choice_is_saved_renamed_taken_over_and_put_away(ctx: Context, project: dict[str, Any]) -> None:
    process.set_process(ctx, project["id"], {"without": ["jump"]})
    saved = process.save_template(ctx, project["id"], "Our sanding", "Jumps cost nothing here.")
    process.change_template(ctx, saved["id"], {"name": "Sanding, hall 2"})
    other = projects.create_project(ctx, "Another")
    assert process.set_process(ctx, other["id"], {"template": saved["id"]})["feature_set"] == "clean~jump"
    assert [t["name"] for t in process.list_templates(ctx)][-1] == "Sanding, hall 2"
    process.delete_template(ctx, saved["id"])
    assert all(t["built_in"] for t in process.list_templates(ctx))
    with pytest.raises(InvalidInput, match="Built-in"):
        process.change_template(ctx, "layup", {"name": "Mine"})


def test_a_run_and_its_policy_keep_the_features_they_started_with(ctx: Context, project: dict[str, Any]) -> None:
    put(ctx, "small_first.py", OWN.replace(" + 0 * done", " * (1 - done.mean(axis=1, keepdims=True))"))
    process.set_process(ctx, project["id"], {"without": ["opposite_unfinished", "opposite_finished"], "own": ["small_first"]})
    run = runs.start_run(ctx, project["id"], "performance", {}, 1, "paper")
    for _ in range(60):
        assert ctx.jobs.wait_idle(60)
        run = runs.get_run(ctx, run["id"])
        if run["state"] != "waiting_for_expert":
            break
        for query in runs.list_queries(ctx, run_id=run["id"], state="open"):
            runs.answer(ctx, query["id"], "not_similar")
    if run["state"] in ("infeasible", "stalled"):
        run = runs.finish_run(ctx, run["id"])
    assert run["state"] == "converged"
    process.set_process(ctx, project["id"], {"without": [], "own": []})
    policy = next(p for p in policies.list_policies(ctx, project["id"]))
    assert policy["feature_set"].startswith("clean~opposite_finished~opposite_unfinished+small_first@")
    assert "small_first" in [w["key"] for w in policy["weights"]]
    fresh = tools.list_tools(ctx, project["id"])[-1]
    plan = policies.make_plan(ctx, policy["id"], fresh["id"])
    assert sorted(plan["sequence"]) == list(range(fresh["region_count"]))
    assert len(plan["features"]) == len(policy["weights"])


def test_thresholds_of_ones_own_change_the_report_and_outlive_a_switched_off_feature(ctx: Context, project: dict[str, Any]) -> None:
    """Everything is 'small' under a threshold above all values; stored with the report; waits while the feature is off; reset."""

    def height(report: dict[str, Any]) -> dict[str, Any]:
        return next(t for t in report["thresholds"] if t["feature"] == "height")

    usual = coverage.get_coverage(ctx, project["id"])
    assert height(usual)["rule"] == "quantile"
    assert [t["suspected"] for t in usual["thresholds"]] == sorted((t["suspected"] for t in usual["thresholds"]), reverse=True)
    seen = coverage.set_levels(ctx, project["id"], "height", "expert", (5.0, 6.0))
    assert (height(seen)["low"], height(seen)["high"], height(seen)["rule"]) == (5.0, 6.0, "expert")
    cells = seen["tables"][0]["cells"]
    assert {c["state"] for c in (*cells[1], *cells[2])} == {"impossible"}
    process.set_process(ctx, project["id"], {"without": ["height"]})
    assert all(t["feature"] != "height" for t in coverage.get_coverage(ctx, project["id"])["thresholds"])
    process.set_process(ctx, project["id"], {"without": []})
    assert height(coverage.get_coverage(ctx, project["id"]))["rule"] == "expert"
    assert height(coverage.set_levels(ctx, project["id"], "height", "range"))["rule"] == "range"
    before = process.get_process(ctx, project["id"])
    process.set_process(ctx, project["id"], {"template": "spraying"})
    assert height(coverage.get_coverage(ctx, project["id"]))["rule"] == "range"  # the usual one of spraying
    assert process.get_process(ctx, project["id"])["by_hand"] == {"chosen": {}, "expert": {}}
    undone = process.set_process(
        ctx, project["id"], {"template": before["template"], "levels": before["levels"], "by_hand": before["by_hand"]}
    )
    assert undone["by_hand"] == before["by_hand"] == {"chosen": {"height": "range"}, "expert": {}}
    process.set_process(ctx, project["id"], {"by_hand": {"chosen": {}, "expert": {"height": (5.0, 6.0)}}})
    assert height(coverage.get_coverage(ctx, project["id"]))["rule"] == "expert"
    with pytest.raises(UnknownFeature, match="no feature 'colour'"):
        process.set_process(ctx, project["id"], {"by_hand": {"chosen": {"colour": "range"}, "expert": {}}})
    reset = height(coverage.set_levels(ctx, project["id"], "height", None))
    assert {**reset, "suspected": True} == height(usual)  # the interactions went with the feature
    with pytest.raises(InvalidInput, match="smaller one first"):
        coverage.set_levels(ctx, project["id"], "height", "expert", (2.0, 1.0))
    with pytest.raises(UnknownFeature, match="no feature 'colour'"):
        coverage.set_levels(ctx, project["id"], "colour", "range")
