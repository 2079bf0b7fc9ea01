"""One shape for every error of every route."""

from typing import Any

import pytest
from starlette.testclient import TestClient

from tests.api.files import REAL_TABLE, tetrahedron
from tests.api.problems import check_problem

UNKNOWN = "00000000-0000-7000-8000-000000000000"
BODIES: dict[str, dict[str, Any]] = {
    "create_project": {"name": "x"},
    "update_project": {"name": "x"},
    "answer_tool": {"name": "x"},
    "segment_tool": {},
    "rename_region": {"name": "x"},
    "place": {"sequence": []},
    "pick": {"region": 0},
    "save": {},
    "create_demonstration": {"sequence": [0]},
    "update_demonstration": {"name": "x"},
    "set_interactions": {"interactions": []},
    "set_levels": {"rule": "range"},
    "set_process": {"without": []},
    "save_template": {"project_id": UNKNOWN, "name": "x"},
    "change_template": {"name": "x"},
    "start_run": {"kind": "performance"},
    "answer_query": {"value": "similar"},
    "make_plan": {"tool_id": UNKNOWN},
    "ask_about": {"tool_id": UNKNOWN},
    "what_if": {"sequence": [0]},
    "start_playback": {},
    "create_session": {"project_id": UNKNOWN},
    "show": {"mode": "empty"},
    "change_editing": {"selection": []},
    "control_playback": {"action": "pause"},
}
UPLOADS = {
    "upload_tool": ("x.stl", tetrahedron()),
    "import_region_table": ("x.csv", REAL_TABLE.encode()),
    "read_answers": ("x.csv", b"query id,answer\n"),
}
WITHOUT_IDS = {
    "region_table_template",
    "list_projects",
    "create_project",
    "create_sample_project",
    "list_templates",
    "list_studies",
    "healthz",
    "readyz",
}


def operations(client: TestClient) -> list[tuple[str, str, dict[str, Any]]]:
    """(method, path, operation) of the whole OpenAPI document."""
    paths = client.get("/openapi.json").json()["paths"]
    return [(method.upper(), path, operation) for path, methods in paths.items() for method, operation in methods.items()]


def request_of(method: str, path: str, operation: dict[str, Any]) -> dict[str, Any]:
    """A well-formed request about things that don't exist."""
    address = path.format(
        region="0", **{p["name"]: UNKNOWN for p in operation.get("parameters", []) if p["in"] == "path" and p["name"] != "region"}
    )
    request: dict[str, Any] = {"method": method, "url": address, "headers": {}}
    needed = {p["name"] for p in operation.get("parameters", []) if p.get("required")}
    if "If-Match" in needed:
        request["headers"]["If-Match"] = '"1"'
    if "kind" in needed:
        request["params"] = {"kind": "performance"}
    if "sequence" in needed:
        request["params"] = {"sequence": "0,1,2"}
    if operation["operationId"] in UPLOADS:
        request["files"] = {"file": UPLOADS[operation["operationId"]]}
    elif operation["operationId"] in BODIES:
        request["json"] = BODIES[operation["operationId"]]
    if operation["operationId"] == "stream_events":
        request["params"] = {"project": UNKNOWN}
    return request


def test_unknown_ids_are_404_on_every_route(client: TestClient) -> None:
    """Whatever names something that isn't there says so, in the one shape."""
    walked = 0
    for method, path, operation in operations(client):
        if operation["operationId"] in WITHOUT_IDS:
            continue
        check_problem(client.request(**request_of(method, path, operation)), 404, "NotFound")
        walked += 1
    assert walked >= 40


def test_bodies_that_are_no_json_are_422_on_every_route(client: TestClient) -> None:
    walked = 0
    for method, path, operation in operations(client):
        if operation["operationId"] not in BODIES:
            continue
        request = request_of(method, path, operation)
        request.pop("json")
        request["headers"]["Content-Type"] = "application/json"
        detail = check_problem(client.request(**request, content=b'{"name": '), 422, "InvalidInput")
        assert "not valid JSON" in detail
        walked += 1
    assert walked == len(BODIES)


def test_unknown_fields_are_422_on_every_route(client: TestClient) -> None:
    for method, path, operation in operations(client):
        if operation["operationId"] in BODIES:
            request = request_of(method, path, operation)
            request["json"] = {**request["json"], "nmae": 1}
            detail = check_problem(client.request(**request), 422, "InvalidInput")
            assert detail == "nmae is not a known field."


def test_changes_of_versioned_things_need_a_version(client: TestClient) -> None:
    """428 without If-Match; the seven changes of the three versioned nouns."""
    seen = []
    for method, path, operation in operations(client):
        if any(p["name"] == "If-Match" for p in operation.get("parameters", [])):
            request = request_of(method, path, operation)
            request["headers"].clear()
            detail = check_problem(client.request(**request), 428, "VersionRequired")
            assert "If-Match" in detail
            seen.append(operation["operationId"])
    assert sorted(seen) == [
        "answer_tool", "delete_demonstration", "delete_project", "delete_tool", "set_process", "update_demonstration", "update_project",
    ]  # fmt: skip


def test_wrong_methods_name_all_the_right_ones(client: TestClient) -> None:
    """405 with Allow from all routes of the path, on every path."""
    paths = client.get("/openapi.json").json()["paths"]
    for path, methods in paths.items():
        known = {m.upper() for m in methods}
        wrong = next(m for m in ("PUT", "PATCH", "DELETE") if m not in known)
        response = client.request(wrong, path.replace("{region}", "0").replace("{", "").replace("}", ""))
        check_problem(response, 405, "MethodNotAllowed")
        allowed = set(response.headers["allow"].split(", ")) - {"HEAD"}
        if path.endswith("/projects/sample"):  # also reads as the project called "sample"
            known |= {"GET", "PATCH", "DELETE"}
        assert allowed == known, path


def test_unknown_addresses_are_404(client: TestClient) -> None:
    assert "/api/v1/nothing" in check_problem(client.get("/api/v1/nothing"), 404, "NotFound")
    check_problem(client.get("/static/nothing.js"), 404, "NotFound")


def test_our_own_mistakes_are_logged_and_say_nothing_else(client: TestClient, caplog: pytest.LogCaptureFixture) -> None:
    """An exception outside the error tree becomes a 500 whose request id is in the log."""

    @client.app.get("/mistake")  # type: ignore[attr-defined]
    def mistake() -> None:
        raise ValueError("the secret path /etc/x")

    response = client.get("/mistake")
    detail = check_problem(response, 500, "InternalError")
    assert "secret" not in response.text
    assert response.json()["request_id"] in detail
    assert any(response.json()["request_id"] in record.getMessage() for record in caplog.records)


def test_validation_speaks_in_words(client: TestClient) -> None:
    """Two faults, two sentences; the field comes first."""
    detail = check_problem(client.post("/api/v1/projects", json={"process": 4}), 422)
    assert detail.startswith("name is missing. process can't be used: ")
