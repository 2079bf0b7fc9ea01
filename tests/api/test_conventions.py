"""Versions, idempotency keys and pages of lists."""

import threading

from starlette.testclient import TestClient

from tests.api.problems import check_problem
from tests.conftest import Api


def test_a_change_needs_the_version_seen(client: TestClient, api: Api) -> None:
    """The second of two editors is refused, not merged: lost updates can't happen."""
    created = client.post("/api/v1/projects", json={"name": "Hull", "process": "Sanding"})
    project = created.json()
    assert created.headers["etag"] == f'"{project["version"]}"'
    assert created.headers["location"] == f"/api/v1/projects/{project['id']}"
    address = created.headers["location"]
    first = client.patch(address, json={"name": "Wing"}, headers={"If-Match": created.headers["etag"]})
    assert first.status_code == 200
    assert first.json()["version"] == project["version"] + 1
    assert first.headers["etag"] == f'"{first.json()["version"]}"'
    check_problem(client.patch(address, json={"name": "Keel"}, headers={"If-Match": created.headers["etag"]}), 412, "StaleVersion")
    assert api.get(f"/projects/{project['id']}")["name"] == "Wing"
    check_problem(client.delete(address, headers={"If-Match": created.headers["etag"]}), 412, "StaleVersion")
    api.delete(f"/projects/{project['id']}", first.json()["version"])
    check_problem(client.get(address), 404, "NotFound")


def test_a_repeated_post_acts_once(client: TestClient, api: Api) -> None:
    headers = {"Idempotency-Key": "k-1"}
    first = client.post("/api/v1/projects", json={"name": "Hull"}, headers=headers)
    again = client.post("/api/v1/projects", json={"name": "Hull"}, headers=headers)
    assert (again.status_code, again.json()) == (201, first.json())
    assert again.headers["location"] == first.headers["location"]
    assert again.headers["etag"] == first.headers["etag"]
    assert again.headers["idempotent-replay"] == "true"
    assert len(api.get("/projects")["items"]) == 1
    check_problem(client.post("/api/v1/projects", json={"name": "Wing"}, headers=headers), 422)
    check_problem(client.post("/api/v1/projects", json={"name": "Wing"}, headers={"Idempotency-Key": "k" * 200}), 422)


def test_a_refused_post_may_be_tried_again_with_its_key(client: TestClient) -> None:
    headers = {"Idempotency-Key": "k-2"}
    check_problem(client.post("/api/v1/projects", json={"name": ""}, headers=headers), 422)
    assert client.post("/api/v1/projects", json={"name": "Hull"}, headers=headers).status_code == 201


def test_one_key_in_flight_many_times_acts_once(client: TestClient, api: Api) -> None:
    """Ten clients at once with one key get one answer."""
    ids: list[str] = []

    def post() -> None:
        ids.append(client.post("/api/v1/projects", json={"name": "Hull"}, headers={"Idempotency-Key": "k-3"}).json()["id"])

    threads = [threading.Thread(target=post) for _ in range(10)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(ids) == 10
    assert len(set(ids)) == 1
    assert len(api.get("/projects")["items"]) == 1


def test_lists_come_in_pages(client: TestClient, api: Api) -> None:
    """Walking pages of two meets all five items once, in order."""
    for name in "abcde":
        api.post("/projects", {"name": name})
    everything = [p["id"] for p in api.get("/projects")["items"]]
    walked: list[str] = []
    after: dict[str, str] = {}
    while True:
        part = api.get("/projects", params={"limit": "2", **after})
        assert len(part["items"]) <= 2
        walked += [p["id"] for p in part["items"]]
        if part["next"] is None:
            break
        after = {"after": part["next"]}
    assert len(walked) == 5
    assert walked == everything
    check_problem(client.get("/api/v1/projects", params={"limit": "0"}), 422)
    assert "start again" in check_problem(client.get("/api/v1/projects", params={"after": "nothing"}), 422)
