"""The event stream of the real server: order, replay, end."""

import json
import signal
import threading
import time
from collections.abc import Iterator
from typing import Any

import httpx

from tests.api.problems import check_problem
from tests.conftest import Api, LiveServer


def frames(response: httpx.Response) -> Iterator[dict[str, Any]]:
    """Events of a stream as {id, event, data}."""
    frame: dict[str, Any] = {}
    for line in response.iter_lines():
        if not line and frame.get("event"):
            yield frame
            frame = {}
        elif line and not line.startswith(":"):
            name, _, value = line.partition(": ")
            frame[name] = json.loads(value) if name == "data" else value


def test_changes_arrive_and_missed_ones_are_replayed(live_api: Api) -> None:
    """A project's stream holds its own changes only; after a drop, exactly those behind Last-Event-ID, in order."""
    mine = live_api.post("/projects", {"name": "Mine"})
    other = live_api.post("/projects", {"name": "Other"})
    address = "/api/v1/events"
    with live_api.client.stream("GET", address, params={"project": mine["id"]}) as response:
        assert response.headers["content-type"].startswith("text/event-stream")
        stream = frames(response)
        names = ["a", "b", "c"]
        changer = threading.Thread(target=rename_all, args=(live_api, other, mine, names))
        changer.start()
        seen = [next(stream) for _ in names]
        changer.join()
    assert [frame["event"] for frame in seen] == ["project.changed"] * 3
    assert {frame["data"]["project_id"] for frame in seen} == {mine["id"]}
    ids = [int(frame["id"]) for frame in seen]
    assert ids == sorted(set(ids))
    with live_api.client.stream("GET", address, params={"project": mine["id"]}, headers={"Last-Event-ID": seen[0]["id"]}) as response:
        stream = frames(response)
        assert [next(stream)["id"], next(stream)["id"]] == [seen[1]["id"], seen[2]["id"]]


def rename_all(api: Api, other: dict[str, Any], mine: dict[str, Any], names: list[str]) -> None:
    for number, name in enumerate(names):
        for project in (other, mine):
            headers = {"If-Match": f'"{project["version"] + number}"'}
            api.call("PATCH", f"/projects/{project['id']}", 200, json={"name": name}, headers=headers)


def test_streams_end_when_the_server_stops(live_server: LiveServer, live_api: Api) -> None:
    """SIGTERM with an open stream: the stream ends by itself, not by the end of the grace period."""
    check_problem(live_api.client.get("/api/v1/events", params={"project": "nothing"}), 404, "NotFound")
    with live_api.client.stream("GET", "/api/v1/events") as response:
        lines = response.iter_lines()
        assert next(lines).startswith(":")
        begin = time.monotonic()
        assert live_server.process is not None
        live_server.process.send_signal(signal.SIGTERM)
        assert [line for line in lines if line.startswith("data")] == []
        assert time.monotonic() - begin < 1.9
    live_server.process.wait(20)
    assert "Traceback" not in live_server.log.read_text()
