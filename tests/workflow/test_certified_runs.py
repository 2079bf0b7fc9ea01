"""Certified runs, the default: pairs on tools nobody demonstrated, a certificate, the same bits after every interruption."""

from typing import Any

import pytest
from sqlmodel import col, select

from app.errors import InvalidInput, RunActive
from app.settings import Settings
from app.storage.tables import JobRow, RunCheckpoint
from app.workflow import demonstrations, policies, runs, tools
from app.workflow.context import Context, open_context
from tests.workflow.conftest import open_questions, project_of, settle

Json = dict[str, Any]
SEED = 1
STRICT = {"tolerance": 0.0001, "batch": 2}  # the sample's five demonstrations leave little open


def opinion(query: Json) -> str:
    """A fixed opinion that mixes answers."""
    left, right = query["left"]["sequence"], query["right"]["sequence"]
    return ("left", "right", "both_wrong")[(left[0] + 2 * right[-1]) % 3]


def waiting(ctx: Context) -> Json:
    run = settle(ctx, runs.start_run(ctx, project_of(ctx)["id"], "performance", STRICT, SEED))
    assert run["state"] == "waiting_for_expert", run
    return run


def finish(ctx: Context, run: Json) -> Json:
    """Answer to the end."""
    for _ in range(40):
        run = settle(ctx, run)
        if run["state"] != "waiting_for_expert":
            return run
        for query in open_questions(ctx, run):
            runs.answer(ctx, query["id"], opinion(query))
    raise AssertionError(f"asks for ever: {run}")


def weights(ctx: Context, run: Json) -> list[float]:
    def query(session: Any) -> list[float]:
        wanted = select(RunCheckpoint.weights).where(RunCheckpoint.run_id == run["id"]).order_by(col(RunCheckpoint.number).desc())
        return list(session.exec(wanted).first())

    return ctx.store.read(query)


@pytest.fixture(scope="module")
def undisturbed(sample_folder: Any, tmp_path_factory: pytest.TempPathFactory) -> list[float]:
    """Weights of a run that nothing interrupts."""
    import shutil

    folder = tmp_path_factory.mktemp("undisturbed") / "data"
    shutil.copytree(sample_folder, folder)
    ctx = open_context(Settings(data=folder, executor="inline"))
    result = weights(ctx, finish(ctx, waiting(ctx)))
    ctx.close()
    return result


def test_asks_about_tools_nobody_recorded(sample: Context) -> None:
    run = waiting(sample)
    assert (run["kind"], run["mode"]) == ("performance", "certified")
    questions = open_questions(sample, run)
    assert 1 <= len(questions) <= 2
    for query in questions:
        assert query["kind"] == "pair"
        assert query["tool_id"] not in run["tools"]
        assert sorted(query["left"]["sequence"]) == sorted(query["right"]["sequence"]) == list(range(len(query["left"]["sequence"])))
        assert [c["value"] for c in query["choices"]] == ["left", "right", "equal", "both_wrong", "cant_tell"]
        assert "eft order" in query["difference"]
        assert query["differs"]


def test_a_finished_run_leaves_a_certificate(sample: Context) -> None:
    run = finish(sample, waiting(sample))
    assert run["state"] == "converged", run
    assert run["message"].startswith("Every recorded order is the best one on its tool.")
    policy = policies.get_policy(sample, run["policy_id"])
    assert [w["value"] for w in policy["weights"]] == weights(sample, run)
    proof = policy["certificate"]
    assert proof == run["report"]
    assert proof["realisable"] is True
    assert proof["margin"] > 0
    assert [(i["first"], i["tested"]) for i in proof["interactions"]] == [("height", True), ("orientation", True)]
    assert policy["interactions"] == [{k: i[k] for k in ("first", "second")} for i in proof["interactions"] if i["kept"]]
    assert all(w["interval"][0] - 1e-9 <= w["share"] <= w["interval"][1] + 1e-9 for w in policy["weights"] if w["share"] > 0.05)
    assert all(sorted(d["sequence"]) == list(range(len(d["sequence"]))) for d in proof["demonstrations"])
    assert {d["tool_id"] for d in proof["demonstrations"]} == set(run["tools"])
    assert all(d["slack"] == 0 and d["ties"] >= 1 for d in proof["demonstrations"])
    assert {t["tool_name"] for t in proof["tools"]} == {
        t["name"] for t in tools.list_tools(sample, run["project_id"]) if t["id"] not in run["tools"]
    }
    assert all(0 <= t["probability"] <= 1 for t in proof["tools"])
    assert proof["expected_wrong"] == pytest.approx(sum(1 - t["probability"] for t in proof["tools"]))
    assert policy["learned_from"] == {"demonstrations": 5, "answers": run["answered"]}


def test_usual_values_need_few_answers(sample: Context) -> None:
    """At the usual tolerance of half a percent of cost."""
    run = settle(sample, runs.start_run(sample, project_of(sample)["id"], "performance"))
    run = finish(sample, run)
    assert run["state"] == "converged"
    assert run["answered"] <= 6
    assert run["seed"] == 1


def test_goes_on_after_stops_between_questions_and_answers(sample_settings: Settings, undisturbed: list[float]) -> None:
    ctx = open_context(sample_settings)
    run = waiting(ctx)
    for _ in range(30):
        ctx.jobs.wait_idle(60)
        before = open_questions(ctx, run)
        ctx.close()
        ctx = open_context(sample_settings)
        run = settle(ctx, run)
        assert [q["id"] for q in open_questions(ctx, run)] == [q["id"] for q in before]
        if run["state"] != "waiting_for_expert":
            break
        for query in before[:1]:
            runs.answer(ctx, query["id"], opinion(query))
    assert run["state"] == "converged"
    assert weights(ctx, run) == undisturbed
    ctx.close()


def test_a_step_that_was_cut_off_gives_the_same_weights(sample_settings: Settings, undisturbed: list[float]) -> None:
    """As after SIGKILL in the middle of a step: the job row says running, nothing of the step is stored."""
    ctx = open_context(sample_settings)
    ctx.jobs.close()  # nobody works
    run = runs.start_run(ctx, project_of(ctx)["id"], "performance", STRICT, SEED)

    def cut_off(session: Any) -> None:
        row = session.exec(select(JobRow).where(JobRow.subject_id == run["id"])).one()
        row.state, row.attempt = "running", 1
        session.add(row)

    ctx.store.write(cut_off)
    ctx.store.close()
    ctx = open_context(sample_settings)
    assert weights(ctx, finish(ctx, run)) == undisturbed
    ctx.close()


def test_undo_after_the_run_moved_on_returns_to_the_question(sample: Context, undisturbed: list[float]) -> None:
    run = waiting(sample)
    first = open_questions(sample, run)
    given = [runs.answer(sample, q["id"], "cant_tell") for q in first]
    run = settle(sample, run)
    runs.undo_answer(sample, given[0]["id"])
    if len(given) > 1:
        runs.undo_answer(sample, given[1]["id"])
    run = runs.get_run(sample, run["id"])
    assert (run["state"], run["round"], run["policy_id"]) == ("waiting_for_expert", 1, None)
    assert [q["id"] for q in open_questions(sample, run)] == [q["id"] for q in first]
    assert weights(sample, finish(sample, run)) == undisturbed


def test_a_contradiction_names_the_tool_and_the_compromise_can_be_taken(sample: Context) -> None:
    project = project_of(sample)["id"]
    tool = next(t for t in tools.list_tools(sample, project) if t["split"] == "train" and not t["demonstrated"])
    demonstrations.create_demonstration(sample, tool["id"], list(range(12)))
    run = settle(sample, runs.start_run(sample, project, "performance"))
    assert run["state"] == "infeasible", run["message"]
    assert run["message"].startswith(tool["name"])
    assert run["error"]["tools"] == [tool["id"]]
    slack = {d["tool_id"]: d["slack"] for d in run["report"]["demonstrations"]}
    assert max(slack, key=slack.__getitem__) == tool["id"]
    assert run["report"]["conflicts"]
    assert all(tool["id"] in {t["tool_id"] for t in c["tools"]} for c in run["report"]["conflicts"])
    done = settle(sample, runs.finish_run(sample, run["id"]))
    assert done["state"] == "converged"
    policy = policies.get_policy(sample, done["policy_id"])
    assert policy["converged"] is False
    assert policy["certificate"]["kind"] == "likelihood"
    assert 0 < policy["certificate"]["held_out_hits"] <= policy["certificate"]["of"] == 6
    unseen = next(t for t in tools.list_tools(sample, project) if t["split"] == "test")
    plan = policies.make_plan(sample, policy["id"], unseen["id"])
    assert sorted(plan["sequence"]) == list(range(unseen["region_count"]))
    assert sum(step["total"] for step in plan["steps"]) == pytest.approx(plan["cost"], abs=1e-9)
    effort = settle(sample, runs.start_run(sample, project, "effort"))
    assert effort["state"] in ("waiting_for_expert", "converged"), effort["message"]


def test_a_tool_with_an_open_question_stays(sample: Context) -> None:
    run = waiting(sample)
    asked = {q["tool_id"] for q in open_questions(sample, run)}
    tool = tools.get_tool(sample, asked.pop())
    with pytest.raises(RunActive, match=tool["name"]):
        tools.delete_tool(sample, tool["id"], tool["version"])


def test_a_tool_deleted_meanwhile_is_not_asked_about(sample: Context) -> None:
    run = waiting(sample)
    asked = {q["tool_id"] for q in open_questions(sample, run)}
    free = [t for t in tools.list_tools(sample, run["project_id"]) if t["id"] not in run["tools"] and t["id"] not in asked]
    for tool in free:
        tools.delete_tool(sample, tool["id"], tool["version"])
    run = finish(sample, run)
    assert run["state"] == "converged"
    every = {q["tool_id"] for q in runs.list_queries(sample, run_id=run["id"])}
    assert not every & {t["id"] for t in free}
    assert {t["tool_id"] for t in run["report"]["tools"]} == asked


def test_an_unknown_mode_is_refused(sample: Context) -> None:
    with pytest.raises(InvalidInput, match="certified or paper"):
        runs.start_run(sample, project_of(sample)["id"], "performance", mode="fast")
    with pytest.raises(InvalidInput, match="no parameter 'alpha'"):
        runs.start_run(sample, project_of(sample)["id"], "performance", {"alpha": 1})


def test_an_order_recorded_because_both_were_wrong_is_learned_from(sample: Context) -> None:
    """The run goes on with it where it was: earlier answers stay, and the new order is one of those it explains."""
    run = waiting(sample)
    first, other = open_questions(sample, run)
    runs.answer(sample, first["id"], "both_wrong")
    assert [entry["tool_id"] for entry in runs.get_run(sample, run["id"])["to_show"]] == [first["tool_id"]]
    wanted = first["left"]["sequence"][::-1]
    demonstrations.create_demonstration(sample, first["tool_id"], wanted)
    run = settle(sample, run)
    assert (run["to_show"], run["tools"][-1]) == ([], first["tool_id"])
    if run["state"] == "waiting_for_expert":
        assert [q["id"] for q in open_questions(sample, run)] == [other["id"]]
    assert run["answered"] == 1
    shown = run["report"]["demonstrations"]
    assert len(shown) == len(run["tools"]) == 6
    assert shown[-1]["tool_id"] == first["tool_id"]

    unasked = next(t for t in tools.list_tools(sample, project_of(sample)["id"]) if t["id"] not in run["tools"])
    demonstrations.create_demonstration(sample, unasked["id"], list(range(unasked["region_count"])))
    assert runs.get_run(sample, run["id"])["tools"] == run["tools"]
