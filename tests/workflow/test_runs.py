"""Runs that wait for a person, in the paper's mode: stopped, answered twice, taken back, pulled from under.

The other mode is in `test_certified_runs`.
"""

import threading
from collections.abc import Callable
from typing import Any

import pytest
from sqlmodel import col, select

from app.errors import AlreadyAnswered, Conflict, InvalidInput, RunActive
from app.settings import Settings
from app.storage.tables import Answer, JobRow, Query, RunCheckpoint
from app.workflow import demonstrations, policies, projects, runs, tools
from app.workflow.context import Context, open_context
from tests.workflow.conftest import open_questions, project_of, settle

Json = dict[str, Any]
Opinion = Callable[[Json], str]
SEED = 1


def opinion(query: Json) -> str:
    """A fixed opinion that mixes answers."""
    if query["kind"] == "preference":
        return "left" if query["left"]["sequence"][0] <= query["right"]["sequence"][0] else "right"
    return "similar" if query["left"]["sequence"][-1] == query["right"]["sequence"][-1] else "not_similar"


def waiting(ctx: Context, kind: str = "performance") -> Json:
    run = settle(ctx, runs.start_run(ctx, project_of(ctx)["id"], kind, {}, SEED, "paper"))
    assert run["state"] == "waiting_for_expert", run
    return run


def finish(ctx: Context, run: Json) -> Json:
    """Answer to the end."""
    for _ in range(60):
        run = settle(ctx, run)
        if run["state"] == "stalled":
            return runs.finish_run(ctx, run["id"])
        if run["state"] != "waiting_for_expert":
            return run
        for query in open_questions(ctx, run):
            runs.answer(ctx, query["id"], opinion(query))
    raise AssertionError(f"asks for ever: {run}")


def weights(ctx: Context, run: Json) -> list[float]:
    """The last checkpoint's weights: every run has them, whatever its end."""

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
    run = finish(ctx, waiting(ctx))
    result = weights(ctx, run)
    ctx.close()
    return result


def test_a_run_goes_on_after_stops_between_questions_and_answers(sample_settings: Settings, undisturbed: list[float]) -> None:
    """Closed and opened again before and after each single answer; the same questions are open, the weights are bit-equal."""
    ctx = open_context(sample_settings)
    run = waiting(ctx)
    for _ in range(40):
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
    if run["state"] == "stalled":
        run = runs.finish_run(ctx, run["id"])
    assert weights(ctx, run) == undisturbed
    ctx.close()


def test_a_step_that_was_cut_off_gives_the_same_weights(sample_settings: Settings, undisturbed: list[float]) -> None:
    """As after SIGKILL in the middle of a step: the job row says running, nothing of the step is stored."""
    ctx = open_context(sample_settings)
    ctx.jobs.close()  # nobody works
    run = runs.start_run(ctx, project_of(ctx)["id"], "performance", {}, SEED, "paper")

    def cut_off(session: Any) -> None:
        row = session.exec(select(JobRow).where(JobRow.subject_id == run["id"])).one()
        row.state, row.attempt = "running", 1
        session.add(row)

    ctx.store.write(cut_off)
    ctx.store.close()
    ctx = open_context(sample_settings)
    run = finish(ctx, run)
    assert weights(ctx, run) == undisturbed
    ctx.close()


def test_a_finished_run_leaves_a_policy_and_its_history(sample: Context) -> None:
    run = finish(sample, waiting(sample))
    assert run["policy_id"] is not None, run
    policy = policies.get_policy(sample, run["policy_id"])
    assert [w["value"] for w in policy["weights"]] == weights(sample, run)
    assert policy["learned_from"] == {"demonstrations": 5, "answers": run["answered"]}
    assert run["answered"] == run["asked"] >= 1
    items = runs.metrics(sample, run["id"])
    assert [m["iteration"] for m in items] == list(range(1, run["iteration"] + 1))
    assert all(sum(m["terms"].values()) == pytest.approx(m["loss"]) for m in items)
    assert runs.metrics(sample, run["id"], after=3) == items[3:]


def test_a_converged_run_reports_no_violation(sample: Context) -> None:
    run = finish(sample, waiting(sample))
    assert run["message"].startswith("Every recorded order is")
    assert run["violations"] == 0
    assert runs.metrics(sample, run["id"])[-1]["violations"] == 0


def test_an_arbitrary_sixth_order_is_named_soon_and_can_be_left_out(sample: Context) -> None:
    """No to everything ends after few questions, with the tool's name; the compromise is a policy that explains the others."""
    project = project_of(sample)["id"]
    tool = next(t for t in tools.list_tools(sample, project) if t["split"] == "train" and not t["demonstrated"])
    demonstrations.create_demonstration(sample, tool["id"], list(range(12)))
    run = waiting(sample)
    assert tool["name"] in run["message"]
    while run["state"] == "waiting_for_expert":
        for query in open_questions(sample, run):
            assert query["tool_id"] == tool["id"]
            runs.answer(sample, query["id"], "not_similar")
        run = settle(sample, run)
    assert run["state"] == "infeasible"
    assert run["round"] <= 2
    assert 1 <= run["asked"] <= 6
    assert run["message"].startswith(f"{tool['name']} contradicts {tools.get_tool(sample, run['tools'][0])['name']}, ")
    assert f"Record {tool['name']} again" in run["message"]
    assert run["error"] == {"error": "ContradictoryAnswers", "detail": run["message"], "tools": [tool["id"]]}

    done = runs.finish_run(sample, run["id"])
    assert (done["state"], done["error"], done["violations"]) == ("converged", None, 1)
    assert tool["name"] in done["message"]
    assert policies.get_policy(sample, done["policy_id"])["converged"] is False
    with pytest.raises(Conflict, match="can be finished"):
        runs.finish_run(sample, run["id"])


def test_two_answers_at_once_exactly_one_counts(sample: Context) -> None:
    run = waiting(sample)
    query = open_questions(sample, run)[0]
    outcomes: list[Any] = []
    gate = threading.Barrier(8)

    def reply(value: str) -> None:
        gate.wait()
        try:
            outcomes.append(runs.answer(sample, query["id"], value))
        except AlreadyAnswered as error:
            outcomes.append(error)

    threads = [threading.Thread(target=reply, args=(("similar", "not_similar")[k % 2],)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    (won,) = [o for o in outcomes if isinstance(o, dict)]
    refused = [o for o in outcomes if not isinstance(o, dict)]
    assert len(refused) == 7
    assert "answered before" in str(refused[0])
    assert runs.get_query(sample, query["id"])["answer"]["value"] == won["value"]
    stored = sample.store.read(lambda session: len(session.exec(select(Answer).where(Answer.query_id == query["id"])).all()))
    assert stored == 1


def test_repeating_an_answer_with_its_key_is_harmless(sample: Context) -> None:
    query = open_questions(sample, waiting(sample))[0]
    first = runs.answer(sample, query["id"], "similar", client_key="k")
    assert runs.answer(sample, query["id"], "similar", client_key="k")["id"] == first["id"]
    with pytest.raises(AlreadyAnswered):
        runs.answer(sample, query["id"], "not_similar", client_key="k")


def test_a_wrong_kind_of_answer_is_refused(sample: Context) -> None:
    query = open_questions(sample, waiting(sample))[0]
    with pytest.raises(InvalidInput, match="similar, not_similar, cant_tell"):
        runs.answer(sample, query["id"], "left")
    assert runs.get_query(sample, query["id"])["state"] == "open"


def test_undo_within_the_round_opens_the_question(sample: Context, undisturbed: list[float]) -> None:
    run = waiting(sample)
    query = open_questions(sample, run)[0]
    given = runs.answer(sample, query["id"], "cant_tell")
    again = runs.undo_answer(sample, given["id"])
    assert (again["id"], again["state"], again["answer"]) == (query["id"], "open", None)
    with pytest.raises(Conflict, match="taken back before"):
        runs.undo_answer(sample, given["id"])
    assert weights(sample, finish(sample, run)) == undisturbed


def test_undo_after_the_round_moved_on_returns_to_it(sample: Context, undisturbed: list[float]) -> None:
    """Later questions are withdrawn; with the usual answer instead the run ends as if nothing had happened."""
    run = waiting(sample)
    first = open_questions(sample, run)
    wrong = {"similar": "not_similar", "not_similar": "similar"}[opinion(first[0])]
    given = runs.answer(sample, first[0]["id"], wrong)
    for query in first[1:]:
        runs.answer(sample, query["id"], opinion(query))
    run = settle(sample, run)
    later = [q["id"] for q in runs.list_queries(sample, run_id=run["id"]) if q["id"] not in {f["id"] for f in first}]
    iteration = run["iteration"]

    runs.undo_answer(sample, given["id"])
    run = runs.get_run(sample, run["id"])
    assert (run["state"], run["round"], run["open_queries"], run["policy_id"]) == ("waiting_for_expert", 1, 1, None)
    assert run["iteration"] < iteration
    assert [m["iteration"] for m in runs.metrics(sample, run["id"])] == list(range(1, run["iteration"] + 1))
    assert all(runs.get_query(sample, key)["state"] == "withdrawn" for key in later)
    assert weights(sample, finish(sample, run)) == undisturbed
    kept = sample.store.read(
        lambda s: [a.value for a in s.exec(select(Answer).where(Answer.query_id == first[0]["id"]).order_by(Answer.id))]
    )
    assert kept == [wrong, "undone", opinion(first[0])]


def test_cancelling_withdraws_and_resuming_asks_the_same(sample: Context, undisturbed: list[float]) -> None:
    run = waiting(sample)
    asked = open_questions(sample, run)
    cancelled = runs.cancel(sample, run["id"])
    assert (cancelled["state"], cancelled["open_queries"]) == ("cancelled", 0)
    with pytest.raises(Conflict, match="no longer asked"):
        runs.answer(sample, asked[0]["id"], "similar")
    with pytest.raises(Conflict, match="nothing to stop"):
        runs.cancel(sample, run["id"])
    runs.resume(sample, run["id"])
    run = settle(sample, run)
    assert run["round"] == 1
    assert [q["id"] for q in open_questions(sample, run)] == [q["id"] for q in asked]
    assert weights(sample, finish(sample, run)) == undisturbed


def test_nothing_is_pulled_from_under_a_run(sample: Context) -> None:
    run = waiting(sample)
    tool = tools.get_tool(sample, run["tools"][0])
    with pytest.raises(RunActive, match=tool["name"]):
        tools.delete_tool(sample, tool["id"], tool["version"])
    with pytest.raises(RunActive):
        projects.delete_project(sample, run["project_id"])
    with pytest.raises(RunActive):
        runs.start_run(sample, run["project_id"], "performance")
    free = next(t for t in tools.list_tools(sample, run["project_id"]) if t["id"] not in run["tools"])
    tools.delete_tool(sample, free["id"], free["version"])
    runs.cancel(sample, run["id"])
    tools.delete_tool(sample, tool["id"], tool["version"])
    with pytest.raises(Conflict, match="was deleted"):
        runs.resume(sample, run["id"])


def test_effort_needs_a_policy_and_adds_to_it(sample: Context) -> None:
    project = project_of(sample)["id"]
    with pytest.raises(InvalidInput, match="teach your order"):
        runs.start_run(sample, project, "effort")
    performance = finish(sample, waiting(sample))
    effort = finish(sample, waiting(sample, "effort"))
    assert effort["policy_id"] is not None, effort
    first, second = (policies.get_policy(sample, r["policy_id"]) for r in (performance, effort))
    assert first["effort_weights"] is None
    assert [w["value"] for w in second["weights"]] == [w["value"] for w in first["weights"]]
    assert len(second["effort_weights"]) == 8
    assert any(w["value"] > 0 for w in second["effort_weights"])


@pytest.mark.parametrize(
    ("params", "words"),
    [
        ({"speed": 1}, "no parameter 'speed'"),
        ({"iterations": 0}, "between 1 and"),
        ({"iterations": 2.5}, "whole number"),
        ({"alpha": -1}, "between 0 and"),
        ({"alpha": True}, "number"),
    ],
)
def test_wrong_parameters_are_refused_in_words(sample: Context, params: Json, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        runs.start_run(sample, project_of(sample)["id"], "performance", params, mode="paper")
    assert runs.list_runs(sample, project_of(sample)["id"]) == []


def test_a_plan_is_the_cheapest_order_found(sample: Context) -> None:
    """Cost adds up over steps and features, and no other order tried is cheaper."""
    run = finish(sample, waiting(sample))
    tool = next(t for t in tools.list_tools(sample, run["project_id"]) if t["split"] == "test")
    plan = policies.make_plan(sample, run["policy_id"], tool["id"])
    assert plan["proved"] is True
    assert sum(sum(step["parts"]) for step in plan["steps"]) == pytest.approx(plan["cost"])
    assert (plan["orders"], plan["demonstrated"]) == ("479,001,600", False)
    same = policies.what_if(sample, plan["id"], plan["sequence"])
    assert same["delta"] == pytest.approx(0, abs=1e-9)
    for shift in range(1, 12):
        other = policies.what_if(sample, plan["id"], plan["sequence"][shift:] + plan["sequence"][:shift])
        assert other["delta"] >= -1e-9
        assert sum(f["delta"] for f in other["features"]) == pytest.approx(other["delta"])


def test_open_questions_are_the_next_step(sample: Context) -> None:
    run = waiting(sample)
    project = project_of(sample)
    assert project["counts"]["open_queries"] == run["open_queries"] >= 1
    assert project["next_step"]["page"] == "teach"
    assert project["next_step"]["title"].startswith(f"{run['open_queries']} question")
    assert next(s for s in project["stages"] if s["key"] == "teach")["state"] == "wait"
    assert sample.store.read(lambda s: {q.state for q in s.exec(select(Query))}) == {"open"}
