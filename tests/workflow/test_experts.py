"""Several experts: orders kept apart, runs that learn from some of them, comparison, consistency."""

from typing import Any

import pytest

from app.errors import InvalidInput
from app.workflow import coverage, demonstrations, experts, queries, record, runs, tools
from app.workflow.context import Context
from tests.workflow.conftest import project_of, settle

Json = dict[str, Any]


@pytest.fixture
def tool(sample: Context) -> Json:
    """A tool nobody has shown."""
    return next(t for t in tools.list_tools(sample, project_of(sample)["id"]) if t["split"] == "train" and not t["demonstrated"])


def standing(ctx: Context, tool: Json) -> dict[str | None, list[int]]:
    rows = demonstrations.list_demonstrations(ctx, tool_id=tool["id"])
    return {d["author"]: d["sequence"] for d in rows if d["superseded_by"] is None}


def test_orders_of_two_experts_stand_side_by_side(sample: Context, tool: Json) -> None:
    """Each replaces only the same expert's; spelling and spaces of a name don't matter."""
    n = tool["region_count"]
    up, down, odd = list(range(n)), list(range(n))[::-1], [*range(1, n), 0]
    demonstrations.create_demonstration(sample, tool["id"], up, author="Anna")
    demonstrations.create_demonstration(sample, tool["id"], down, author="Ben")
    assert standing(sample, tool) == {"Anna": up, "Ben": down}
    record.place(sample, tool["id"], odd)
    record.save(sample, tool["id"], author="  anna ")
    assert standing(sample, tool) == {"anna": odd, "Ben": down}
    shown = tools.get_tool(sample, tool["id"])
    assert shown["demonstrated_by"] == [{"name": "anna", "own": False}, {"name": "Ben", "own": False}]
    report = coverage.get_coverage(sample, tool["project_id"])
    assert report["demonstrations"] == 5 + 2
    assert project_of(sample)["stages"][1]["meta"] == "6"  # tools, not orders


def test_without_names_an_order_takes_the_place_of_the_samples(sample: Context) -> None:
    """As ever: one expert, no name, nothing to keep apart."""
    shown = next(t for t in tools.list_tools(sample, project_of(sample)["id"]) if t["demonstrated"])
    before = demonstrations.get_demonstration(sample, shown["demonstration_id"])
    fresh = demonstrations.create_demonstration(sample, shown["id"], before["sequence"][::-1])
    assert standing(sample, shown) == {None: before["sequence"][::-1]}
    assert demonstrations.get_demonstration(sample, before["id"])["superseded_by"] == fresh["id"]


def test_an_order_saved_under_the_wrong_name_is_given_to_its_expert(sample: Context, tool: Json) -> None:
    n = tool["region_count"]
    old = demonstrations.create_demonstration(sample, tool["id"], list(range(n)), author="Anna")
    new = demonstrations.create_demonstration(sample, tool["id"], list(range(n))[::-1], author="Ben")
    moved = demonstrations.update_demonstration(sample, new["id"], {"author": "Anna"}, new["version"])
    assert moved["author"] == "Anna"
    assert standing(sample, tool) == {"Anna": list(range(n))[::-1]}
    assert demonstrations.get_demonstration(sample, old["id"])["superseded_by"] == new["id"]


def test_the_gain_of_a_draft_counts_the_other_experts_order(sample: Context, tool: Json) -> None:
    """What is announced for Ben is what saving under his name brings; Anna's order stays in."""
    n = tool["region_count"]
    before = coverage.get_coverage(sample, tool["project_id"])["steps"]
    demonstrations.create_demonstration(sample, tool["id"], list(range(n)), author="Anna")
    record.place(sample, tool["id"], [*range(0, n, 2), *range(1, n, 2)])
    promised = record.get_draft(sample, tool["id"], "Ben")["coverage_gain"]
    record.save(sample, tool["id"], author="Ben")
    after = coverage.get_coverage(sample, tool["project_id"])
    assert promised["after"] == after["rho"]
    assert after["steps"] == before + 2 * n


def test_a_run_learns_from_the_experts_it_names(sample: Context, tool: Json) -> None:
    """One of them, or all pooled; contradictions of pooled orders say whose they are."""
    project, n = tool["project_id"], tool["region_count"]
    demonstrations.create_demonstration(sample, tool["id"], list(range(n)), author="Anna")
    with pytest.raises(InvalidInput, match=r"no order by Ben.*Scripted expert, Anna"):
        runs.start_run(sample, project, "performance", authors=["Ben"])
    run = settle(sample, runs.start_run(sample, project, "performance", authors=["scripted expert"]))
    assert run["authors"] == ["Scripted expert"]
    assert tool["id"] not in run["tools"]
    assert run["state"] in ("waiting_for_expert", "converged"), run["message"]
    runs.cancel(sample, run["id"])
    pooled = settle(sample, runs.start_run(sample, project, "performance"))
    assert pooled["authors"] == ["Scripted expert", "Anna"]
    assert len(pooled["tools"]) == 6
    assert pooled["state"] == "infeasible"
    assert pooled["message"].startswith(f"{tool['name']} by Anna")
    assert any(d["tool_name"].endswith("by Scripted expert") for d in pooled["report"]["demonstrations"])


def test_with_one_expert_a_run_names_nobody(sample: Context, tool: Json) -> None:
    run = runs.start_run(sample, tool["project_id"], "performance")
    assert run["authors"] == []
    assert settle(sample, run)["report"]["demonstrations"][0]["tool_name"] in {
        t["name"] for t in tools.list_tools(sample, tool["project_id"])
    }


def test_contradicting_answers_are_weighed_named_and_taken_back_alone(sample: Context) -> None:
    """Sides alternate, so an expert who always says "left" contradicts the check; the run ends all the same and says which."""
    params = {"tolerance": 0.0001, "check": 1, "most": 4}
    run = settle(sample, runs.start_run(sample, project_of(sample)["id"], "performance", params))
    while run["state"] == "waiting_for_expert":
        for query in runs.list_queries(sample, run_id=run["id"], state="open"):
            runs.answer(sample, query["id"], "left")
        run = settle(sample, run)
    assert run["state"] == "converged", run["message"]
    report = run["report"]
    assert report["weighed"] is True
    assert report["consistency"]["answers_twice"] > report["consistency"]["answers_alike"]
    assert report["consistency"]["text"].startswith(("One question was asked twice", "2 questions were asked twice"))
    worst = report["unclear"][0]
    before = {q["id"]: q["answer"] for q in runs.list_queries(sample, run_id=run["id"]) if q["answer"]}
    assert before[worst["query_id"]]["id"] == worst["answer_id"]
    query = queries.undo_answer(sample, worst["answer_id"], keep_later=True)
    assert (query["id"], query["state"]) == (worst["query_id"], "open")
    after = {q["id"]: q["answer"] for q in runs.list_queries(sample, run_id=run["id"]) if q["answer"]}
    assert after == {k: v for k, v in before.items() if k != worst["query_id"]}
    runs.answer(sample, query["id"], "cant_tell")
    again = settle(sample, run)
    assert worst["query_id"] not in {entry["query_id"] for entry in again["report"]["unclear"]}


def test_an_order_recorded_again_measures_consistency(sample: Context, tool: Json) -> None:
    """Kendall's tau with the expert's earlier order; one that was deleted was a mistake and doesn't count."""
    n = tool["region_count"]
    order, swapped = list(range(n)), [1, 0, *range(2, n)]
    first = demonstrations.create_demonstration(sample, tool["id"], order, author="Anna")
    demonstrations.create_demonstration(sample, tool["id"], swapped, author="Anna")
    demonstrations.create_demonstration(sample, tool["id"], order[::-1], author="Ben")

    def again() -> Json:
        run = settle(sample, runs.start_run(sample, tool["project_id"], "performance", authors=["Anna"]))
        if run["state"] == "waiting_for_expert":
            runs.cancel(sample, run["id"])
        return run["report"]["consistency"]

    found = again()
    assert (found["orders_again"], found["orders_same"]) == (1, 0)
    assert found["orders_agreement"] == pytest.approx(1 - 4 / (n * (n - 1)), abs=1e-4)
    assert "recorded a second time" in found["text"]
    now = demonstrations.get_demonstration(sample, first["id"])
    demonstrations.delete_demonstration(sample, first["id"], now["version"])
    assert again()["orders_again"] == 0


def test_like_minded_experts_can_be_pooled_others_are_told_apart(sample: Context, tool: Json) -> None:
    """Anna repeats two of the sample's orders; then Ben works one of them backwards."""
    project = tool["project_id"]
    assert [e["name"] for e in experts.experts(sample, project)["experts"]] == ["Scripted expert"]
    shown = [d for d in demonstrations.list_demonstrations(sample, project_id=project) if d["author"] == "Scripted expert"][:2]
    for d in shown:
        demonstrations.create_demonstration(sample, d["tool_id"], d["sequence"], author="Anna")
    found = experts.experts(sample, project)
    assert [(e["name"], e["own"], len(e["tools"]), e["explained"]) for e in found["experts"]] == [
        ("Scripted expert", True, 5, True),
        ("Anna", False, 2, True),
    ]
    assert found["pooling"]["safe"] is True
    assert [(r["agreement"], r["just_as_good"], r["differs"]) for r in found["tools"]] == [(1.0, True, [])] * 2
    assert found["pairs"][0]["text"].startswith("Scripted expert and Anna have both recorded 2 tools: 2 in the same order")

    backwards = shown[0]["sequence"][::-1]
    demonstrations.create_demonstration(sample, shown[0]["tool_id"], backwards, author="Ben")
    found = experts.experts(sample, project)
    assert found["pooling"]["safe"] is False
    assert "Ben" in {c["author"] for c in found["pooling"]["clash"]}
    row = next(r for r in found["tools"] if r["recorded"] and r["second"]["author"] == "Ben")
    assert (row["agreement"], row["just_as_good"]) == (-1.0, False)
    assert row["extra"] > 0
    assert "backwards" in row["text"]
    svg = experts.tool_picture(sample, row["tool_id"], row["first"]["sequence"], row["second"]["sequence"])
    assert svg.count("<circle") == len(backwards)
    assert svg.count('stroke-width="2.2"') == len(row["differs"])
