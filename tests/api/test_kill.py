"""Learners never wait for a person: the power goes while a question is open, and nothing is lost."""

from dataclasses import dataclass, field
from typing import Any

from tests.conftest import Api, LiveServer

Json = dict[str, Any]

SETTLED = ("waiting_for_expert", "converged", "stalled", "infeasible", "failed")
SEED = 3
REGIONS = 8
PARAMS = {"paper": {}, "certified": {"batch": 2, "samples": 200, "most": 8}}
TOOLS = {"paper": 1, "certified": 5}  # a certified run asks about those nobody recorded
TO_AND_FRO = [0, 1, 2, 3, 7, 6, 5, 4]


@dataclass
class Case:
    """A run in a project of its own, always the same one, and all that it asked."""

    api: Api
    mode: str
    run: Json = field(default_factory=dict)
    asked: list[Any] = field(default_factory=list)

    def start(self) -> "Case":
        project = self.api.post("/projects", {"name": "Tables"})["id"]
        address = f"/projects/{project}/tools/region-table"
        tools = [self.api.upload(address, f"table{k}.csv", table(k)) for k in range(TOOLS[self.mode])]
        for tool in tools:
            self.api.until(f"/tools/{tool['id']}", lambda row: row["state"] == "ready")
        self.api.post(f"/tools/{tools[0]['id']}/demonstrations", {"sequence": TO_AND_FRO, "author": "Kim"})
        body = {"kind": "performance", "mode": self.mode, "seed": SEED, "params": PARAMS[self.mode]}
        self.run = self.api.post(f"/projects/{project}/runs", body, status=202)
        return self

    def settle(self) -> Json:
        self.run = self.api.until(f"/runs/{self.run['id']}", lambda row: row["state"] in SETTLED, seconds=120)
        return self.run

    def questions(self) -> list[Json]:
        return self.api.get(f"/runs/{self.run['id']}/queries", params={"state": "open"})["items"]

    def answer(self, query: Json) -> None:
        """A fixed opinion about two sequences, the same in every project."""
        left, right = query["left"]["sequence"], query["right"]["sequence"]
        opinions = {"paper": ("similar", "not_similar")[left[-1] != right[-1]], "certified": ("left", "right")[left[0] > right[0]]}
        self.asked.append((query["tool_name"], left, right))
        self.api.post(f"/queries/{query['id']}/answer", {"value": opinions[self.mode]})

    def finish(self) -> list[float]:
        """Answer to the end; the policy's weights."""
        for _ in range(60):
            if self.settle()["state"] != "waiting_for_expert":
                assert self.run["state"] == "converged", (self.run["state"], self.run["message"], self.run["error"])
                return [weight["value"] for weight in self.api.get(f"/policies/{self.run['policy_id']}")["weights"]]
            for query in self.questions():
                self.answer(query)
        raise AssertionError("the run asks for ever")


def table(number: int) -> bytes:
    """Two rows of four regions; the first tool rises evenly, the others are rough."""
    rows = []
    for i in range(REGIONS):
        height, bend = (40 + 7 * (i * (5 + 2 * number) % 11), (i * (7 + number) + 3 * number) % 9 - 4) if number else (50 + 9 * i, 0)
        rows.append(f"r{i},{400 * (i % 4)},{300 * (i // 4)},400,300,{height},{bend}")
    return "\n".join(["region,x_mm,y_mm,width_mm,depth_mm,height_mm,curvature_per_m", *rows]).encode()


def test_a_killed_server_loses_nothing(live_server: LiveServer, live_api: Api) -> None:
    """SIGKILL with runs of both modes waiting at a half-answered round and others just training.

    After the restart the same questions are open, the interrupted computations are taken up again, and all runs end
    with weights equal to the last bit to those of undisturbed ones.
    """
    undisturbed = {mode: Case(live_api, mode).start() for mode in PARAMS}
    expected = {mode: case.finish() for mode, case in undisturbed.items()}
    waiting = [Case(live_api, mode).start() for mode in PARAMS]
    for case in waiting:
        assert case.settle()["state"] == "waiting_for_expert"
        case.answer(case.questions()[0])
        assert case.questions(), "a round must be half answered for this test to mean anything"
    still_open = [[query["id"] for query in case.questions()] for case in waiting]
    training = [Case(live_api, mode).start() for mode in PARAMS]
    live_server.kill()
    live_server.start()
    assert [[query["id"] for query in case.questions()] for case in waiting] == still_open
    for case in (*waiting, *training):
        assert case.finish() == expected[case.mode]
        assert case.asked == undisturbed[case.mode].asked
