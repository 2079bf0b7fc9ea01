"""Learners never wait for a person: the power goes while a question is open, and nothing is lost."""

from typing import Any

from tests.conftest import Api, LiveServer

SETTLED = ("waiting_for_expert", "converged", "stalled", "infeasible", "failed")
SEED = 11


def settled(api: Api, run: dict[str, Any]) -> dict[str, Any]:
    return api.until(f"/runs/{run['id']}", lambda row: row["state"] in SETTLED, seconds=120)


def start(api: Api) -> dict[str, Any]:
    project = api.post("/projects/sample")["id"]
    return api.post(f"/projects/{project}/runs", {"kind": "performance", "mode": "paper", "seed": SEED}, status=202)


def questions(api: Api, run: dict[str, Any]) -> list[dict[str, Any]]:
    return api.get(f"/runs/{run['id']}/queries", params={"state": "open"})["items"]


def answer_of(query: dict[str, Any]) -> str:
    """A fixed opinion about two sequences, the same in every project."""
    return "similar" if query["left"]["sequence"][-1] == query["right"]["sequence"][-1] else "not_similar"


def finish(api: Api, run: dict[str, Any], log: list[Any]) -> list[float]:
    """Answer to the end; the policy's weights. `log` gets everything that was asked."""
    for _ in range(60):
        run = settled(api, run)
        if run["state"] == "stalled":
            api.post(f"/runs/{run['id']}/finish", status=202)
            run = api.until(f"/runs/{run['id']}", lambda row: row["policy_id"] is not None)
        if run["state"] != "waiting_for_expert":
            assert run["policy_id"] is not None, (run["state"], run["message"], run["error"])
            return [weight["value"] for weight in api.get(f"/policies/{run['policy_id']}")["weights"]]
        for query in questions(api, run):
            log.append((query["tool_name"], query["left"]["sequence"], query["right"]["sequence"]))
            api.post(f"/queries/{query['id']}/answer", {"value": answer_of(query)})
    raise AssertionError("the run asks for ever")


def test_a_killed_server_loses_nothing(live_server: LiveServer, live_api: Api) -> None:
    """SIGKILL with one run waiting at a half-answered round and another one just training.

    After the restart the same questions are open, the interrupted computation is taken up again, and both runs end
    with weights equal to the last bit to those of an undisturbed run.
    """
    undisturbed: list[Any] = []
    expected = finish(live_api, start(live_api), undisturbed)
    assert undisturbed, "the run must ask something for this test to mean anything"

    waiting = settled(live_api, start(live_api))
    assert waiting["state"] == "waiting_for_expert"
    first = questions(live_api, waiting)[0]
    log: list[Any] = [(first["tool_name"], first["left"]["sequence"], first["right"]["sequence"])]
    live_api.post(f"/queries/{first['id']}/answer", {"value": answer_of(first)})
    still_open = [query["id"] for query in questions(live_api, waiting)]
    assert still_open
    training = start(live_api)
    live_server.kill()
    live_server.start()
    assert [query["id"] for query in questions(live_api, waiting)] == still_open
    assert finish(live_api, waiting, log) == expected
    assert log == undisturbed
    assert finish(live_api, training, []) == expected
