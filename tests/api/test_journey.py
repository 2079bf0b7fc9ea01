"""A project from the first look to the robot, by REST alone."""

import re
import time
from typing import Any

import pytest
from starlette.testclient import TestClient

from tests.api.problems import check_problem
from tests.conftest import Api

EFFORT_OPTIONS = ("travel", "side_changes")
SETTLED = ("waiting_for_expert", "converged", "stalled", "infeasible", "failed", "cancelled")


@pytest.fixture
def sample(api: Api) -> dict[str, Any]:
    return api.post("/projects/sample")


def teach(api: Api, run: dict[str, Any], value: str) -> dict[str, Any]:
    """Answer everything a run asks until it has a policy."""
    for _ in range(60):
        run = api.until(f"/runs/{run['id']}", lambda row: row["state"] in SETTLED, seconds=120)
        if run["state"] == "stalled":
            return api.post(f"/runs/{run['id']}/finish", status=202)
        if run["state"] != "waiting_for_expert":
            return run
        for query in api.get(f"/runs/{run['id']}/queries", params={"state": "open"})["items"]:
            api.post(f"/queries/{query['id']}/answer", {"value": value})
    raise AssertionError(f"still asking: {run}")


def test_the_sample_project_has_something_to_do_at_every_stage(api: Api, sample: dict[str, Any]) -> None:
    """Six tools to train on, four to predict; five are demonstrated."""
    assert sample["sample"] is True
    assert [stage["key"] for stage in sample["stages"]] == ["tools", "demonstrations", "coverage", "teach", "policy", "robot"]
    tools = api.get(f"/projects/{sample['id']}/tools")["items"]
    assert len(tools) >= 10
    assert sample["counts"]["tools"] == len(tools)
    assert [t["split"] for t in tools].count("train") == 6
    assert [t["split"] for t in tools].count("test") == 4
    assert sum(t["demonstrated"] for t in tools) == 5
    assert {t["state"] for t in tools} == {"ready"}
    coverage = api.get(f"/projects/{sample['id']}/coverage")
    assert coverage["rho"] == pytest.approx(coverage["captured"] / coverage["possible"])
    assert coverage["demonstrations"] == 5
    assert all(len(table["cells"]) == 3 and all(len(row) == 3 for row in table["cells"]) for table in coverage["tables"])


def test_recording(client: TestClient, api: Api, sample: dict[str, Any]) -> None:
    """Pick, undo, redo, reorder, clear, save; a second save supersedes the first."""
    tool = next(t for t in api.get(f"/projects/{sample['id']}/tools")["items"] if not t["demonstrated"] and t["split"] == "train")
    draft = f"/tools/{tool['id']}/draft"
    regions = [row["id"] for row in api.get(f"/tools/{tool['id']}/regions")["items"]]
    assert regions == list(range(tool["region_count"]))
    assert api.get(draft)["sequence"] == []
    for region in (2, 0, 1):
        state = api.post(f"{draft}/pick", {"region": region}, status=200)
    assert state["sequence"] == [2, 0, 1]
    assert (state["can_undo"], state["can_redo"], state["complete"]) == (True, False, False)
    assert len(state["click_times"]) == 3
    assert state["click_times"][0] == 0
    assert api.post(f"{draft}/undo", status=200)["sequence"] == [2, 0]
    assert api.post(f"{draft}/redo", status=200)["sequence"] == [2, 0, 1]
    check_problem(client.post(f"/api/v1{draft}/pick", json={"region": 2}), 422, "IncompleteSequence")
    check_problem(client.post(f"/api/v1{draft}/save", json={}), 422, "IncompleteSequence")
    assert api.post(f"{draft}/clear", status=200)["sequence"] == []
    order = regions[::-1]
    state = api.call("PUT", draft, 200, json={"sequence": order})
    assert (state["sequence"], state["complete"]) == (order, True)
    first = api.post(f"{draft}/save", {"name": "First", "author": "Kim"})
    assert (first["name"], first["sequence"], first["source"]) == ("First", order, "recorded")
    assert api.get(f"/tools/{tool['id']}")["demonstration_id"] == first["id"]

    second = api.post(f"/tools/{tool['id']}/demonstrations", {"sequence": regions, "name": "Second", "author": "Kim"})
    assert (second["source"], second["author"]) == ("rest", "Kim")
    assert api.get(f"/demonstrations/{first['id']}")["superseded_by"] == second["id"]
    other = api.post(f"/tools/{tool['id']}/demonstrations", {"sequence": order, "author": "Lee"})
    assert [entry["name"] for entry in api.get(f"/tools/{tool['id']}")["demonstrated_by"]] == ["Lee", "Kim"]
    given = api.call("PATCH", f"/demonstrations/{other['id']}", 200, json={"author": "Kim"}, headers={"If-Match": f'"{other["version"]}"'})
    assert given["author"] == "Kim"
    assert [entry["name"] for entry in api.get(f"/tools/{tool['id']}")["demonstrated_by"]] == ["Kim"]
    second = api.get(f"/demonstrations/{second['id']}")
    address = f"/demonstrations/{second['id']}"
    renamed = api.call("PATCH", address, 200, json={"name": "Other"}, headers={"If-Match": f'"{second["version"]}"'})
    assert renamed["name"] == "Other"
    api.delete(address, renamed["version"])
    assert api.get(f"/tools/{tool['id']}")["demonstration_id"] != second["id"]
    assert api.post(f"{address}/restore", status=200)["deleted"] is False


def test_interactions_change_coverage(client: TestClient, api: Api, sample: dict[str, Any]) -> None:
    choices = sample["interaction_choices"]
    only = {"first": choices[0]["first"], "second": choices[0]["second"]}
    changed = api.call("PUT", f"/projects/{sample['id']}/interactions", 200, json={"interactions": [only]})
    assert [(i["first"], i["second"]) for i in changed["interactions"]] == [(only["first"], only["second"])]
    tables = api.get(f"/projects/{sample['id']}/coverage")["tables"]
    assert [(t["first"], t["second"]) for t in tables] == [(only["first"], only["second"])]
    wrong = {"interactions": [{"first": "height", "second": "colour"}]}
    assert "colour" in check_problem(client.put(f"/api/v1/projects/{sample['id']}/interactions", json=wrong), 422, "UnknownFeature")


def test_teaching_to_the_robot(api: Api, sample: dict[str, Any]) -> None:
    """Performance run, effort run, plan for an undemonstrated tool, playback of the arm on it."""
    project = sample["id"]
    defaults = api.get(f"/projects/{project}/run-defaults", params={"kind": "performance", "mode": "paper"})["parameters"]
    assert all(p["symbol"] and p["label"] for p in defaults)
    run = api.post(f"/projects/{project}/runs", {"kind": "performance", "mode": "paper", "seed": 3}, status=202)
    run = teach(api, run, "not_similar")
    run = api.until(f"/runs/{run['id']}", lambda row: row["policy_id"] is not None)
    metrics = api.get(f"/runs/{run['id']}/metrics")["items"]
    assert [m["iteration"] for m in metrics] == sorted(m["iteration"] for m in metrics)
    assert metrics[-1]["iteration"] == run["iteration"]
    assert len(metrics) >= 4
    later = api.get(f"/runs/{run['id']}/metrics", params={"after": metrics[2]["iteration"]})["items"]
    assert later == metrics[3:]

    check_effort_options(api, project)
    wanted = {"kind": "effort", "seed": 3, "params": {"travel": True, "side_changes": True}}
    effort = teach(api, api.post(f"/projects/{project}/runs", wanted, status=202), "left")
    effort = api.until(f"/runs/{effort['id']}", lambda row: row["state"] in ("converged", "infeasible", "failed"))
    assert effort["state"] == "converged", effort

    tool = next(t for t in api.get(f"/projects/{project}/tools")["items"] if t["split"] == "test")
    policy = api.get(f"/policies/{effort['policy_id']}")
    assert {p["key"]: p["value"] for p in effort["parameters"] if p["key"] in EFFORT_OPTIONS} == dict.fromkeys(EFFORT_OPTIONS, True)
    learned = {w["key"]: w["value"] for w in policy["effort_weights"]}
    assert {key.partition("_")[0] for key in learned} == {"start", "end", "travel", "side"}
    assert all(learned[key] >= 0 for key in EFFORT_OPTIONS)  # an effort, or none
    assert any(learned.values())
    assert {p["id"] for p in api.get(f"/projects/{project}/policies")["items"]} >= {run["policy_id"]}
    plan = api.post(f"/policies/{policy['id']}/plans", {"tool_id": tool["id"]})
    assert sorted(plan["sequence"]) == list(range(tool["region_count"]))
    assert (plan["proved"], plan["counted"], plan["looking"]) == (True, "exactly", False)
    assert sum(step["total"] for step in plan["steps"]) == pytest.approx(plan["cost"])
    for step in plan["steps"]:
        assert sum(step["parts"]) == pytest.approx(step["total"])
    other = api.post(f"/plans/{plan['id']}/what-if", {"sequence": plan["sequence"][::-1]}, status=200)
    assert other["cost"] >= plan["cost"] - 1e-9
    assert other["delta"] == pytest.approx(other["cost"] - plan["cost"])
    assert api.get(f"/policies/{policy['id']}/plans")["items"][0]["id"] == plan["id"]

    asked = {"tool_id": tool["id"], "constraints": {"first": plan["sequence"][-1]}}
    turned = api.post(f"/policies/{policy['id']}/plans", asked)
    assert turned["sequence"][0] == plan["sequence"][-1]
    assert turned["constraints"]["first"] == plan["sequence"][-1]
    assert turned["cost"] >= plan["cost"] - 1e-9
    refused = {"tool_id": tool["id"], "constraints": {"before": [[[0], [1]], [[1], [0]]]}}
    assert "No order can have" in api.post(f"/policies/{policy['id']}/plans", refused, status=422)["detail"]

    check_left_out(api, policy["id"], tool["id"])
    check_thirty_regions(api, project, policy["id"])

    playback = api.post(f"/plans/{plan['id']}/playbacks", {}, status=202)
    playback = api.until(f"/playbacks/{playback['id']}", lambda row: row["state"] in ("ready", "failed"), seconds=200)
    assert playback["state"] == "ready", playback
    assert [row["region"] for row in sorted(playback["regions"], key=lambda row: row["step"])] == plan["sequence"]
    assert playback["cycle_s"] == pytest.approx(playback["series"]["t"][-1], rel=0.1)
    assert 0 < playback["covered"] <= 1


def test_undo_of_an_answer_asks_again(api: Api, sample: dict[str, Any]) -> None:
    """In the default mode, two questions at a time."""
    asked = {"kind": "performance", "seed": 7, "params": {"tolerance": 0.0001, "batch": 2}}
    run = api.post(f"/projects/{sample['id']}/runs", asked, status=202)
    run = api.until(f"/runs/{run['id']}", lambda row: row["state"] in SETTLED, seconds=120)
    queries = api.get(f"/projects/{sample['id']}/queries", params={"state": "open"})["items"]
    assert len(queries) == run["open_queries"] >= 1
    query = queries[0]
    assert [c["value"] for c in query["choices"]] == ["left", "right", "equal", "both_wrong", "cant_tell"]
    assert sorted(query["left"]["sequence"]) == sorted(query["right"]["sequence"])
    if len(queries) > 1:
        answer = api.post(f"/queries/{query['id']}/answer", {"value": "left"})
        assert answer["run_state"] == "waiting_for_expert"
        assert api.get(f"/queries/{query['id']}")["answer"]["value"] == "left"
        reopened = api.post(f"/answers/{answer['id']}/undo", status=200)
        assert (reopened["state"], reopened["answer"]) == ("open", None)


def check_effort_options(api: Api, project: str) -> None:
    """Start and end always count; long ways and changes of side are switched on, with true or false."""
    offered = api.get(f"/projects/{project}/run-defaults", params={"kind": "effort"})["parameters"]
    assert [(p["value"], p["default"]) for p in offered if p["key"] in EFFORT_OPTIONS] == [(False, False)] * 2
    told = api.post(f"/projects/{project}/runs", {"kind": "effort", "params": {"travel": "yes"}}, status=422)["detail"]
    assert told == "params.travel can't be used: it should be a number, or true or false."
    told = api.post(f"/projects/{project}/runs", {"kind": "effort", "params": {"travel": 3}}, status=422)["detail"]
    assert "true or false" in told
    told = api.post(f"/projects/{project}/runs", {"kind": "effort", "params": {"distance": True}}, status=422)["detail"]
    assert "travel, side_changes" in told


def check_left_out(api: Api, policy: str, tool: str) -> None:
    """A plan without region 1: its orders compare with each other, and the robot says what is missing."""
    plan = api.post(f"/policies/{policy}/plans", {"tool_id": tool, "constraints": {"skip": [1]}})
    assert 1 not in plan["sequence"]
    other = api.post(f"/plans/{plan['id']}/what-if", {"sequence": plan["sequence"][::-1]}, status=200)
    assert other["delta"] >= -1e-9
    whole = {"sequence": [*plan["sequence"], 1]}
    assert "left out" in api.post(f"/plans/{plan['id']}/what-if", whole, status=422)["detail"]
    playback = api.post(f"/plans/{plan['id']}/playbacks", {}, status=202)
    playback = api.until(f"/playbacks/{playback['id']}", lambda row: row["state"] in ("ready", "failed"))
    assert playback["error"]["detail"].startswith("This order leaves out B.")


def check_thirty_regions(api: Api, project: str, policy: str) -> None:
    """A grid of 30 regions as a table: too many to prove an order, so the plan says how far off it may be, closer and closer."""
    rows = [f"r{i},{400 * (i % 6)},{300 * (i // 6)},400,300,{40 + 7 * (i * 5 % 11)},{i * 7 % 9 - 4}" for i in range(30)]
    table = "\n".join(["region,x_mm,y_mm,width_mm,depth_mm,height_mm,curvature_per_m", *rows])
    tool = api.upload(f"/projects/{project}/tools/region-table", "thirty.csv", table.encode())
    tool = api.until(f"/tools/{tool['id']}", lambda row: row["state"] == "ready")
    began = time.process_time()
    plan = api.post(f"/policies/{policy}/plans", {"tool_id": tool["id"]})
    assert time.process_time() - began < 20  # seconds, compilers included
    assert sorted(plan["sequence"]) == list(range(30))
    assert (plan["proved"], plan["counted"], plan["looking"]) == (False, "at least", True)
    assert plan["bound"] <= plan["cost"]
    assert re.fullmatch(r"Best found, at most [0-9.]+ % above the optimum", plan["sureness"])

    closer = api.until(f"/plans/{plan['id']}", lambda row: row["bound"] > plan["bound"])
    assert closer["bound"] <= plan["cost"] == closer["cost"]
    assert closer["gap"] == pytest.approx((plan["cost"] - closer["bound"]) / plan["cost"])
    assert closer["sureness"] != plan["sureness"]
    final = api.until(f"/plans/{plan['id']}", lambda row: not row["looking"])
    again = api.post(f"/policies/{policy}/plans", {"tool_id": tool["id"]})  # what was found counts, and nothing is looked for twice
    assert (again["bound"], again["looking"]) == (final["bound"], False)
