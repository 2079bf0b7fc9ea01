"""The gate: host names, origins, sizes, headers."""

import pytest
from starlette.testclient import TestClient

from app.api.guard import JSON_LIMIT
from tests.api.problems import check_problem


def test_foreign_host_names_are_refused(client: TestClient) -> None:
    """DNS rebinding: the browser sends the attacker's name as Host."""
    detail = check_problem(client.get("/api/v1/projects", headers={"Host": "evil.example"}), 421, "UnknownHost")
    assert "127.0.0.1" in detail
    assert client.get("/healthz", headers={"Host": "localhost:1234"}).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:9999"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_foreign_pages_cannot_change_anything(client: TestClient, headers: dict[str, str]) -> None:
    check_problem(client.post("/api/v1/projects", json={"name": "x"}, headers=headers), 403, "Forbidden")
    check_problem(client.get("/api/v1/events", headers=headers), 403, "Forbidden")
    assert client.get("/api/v1/projects").json()["items"] == []


@pytest.mark.parametrize("headers", [{}, {"Origin": "http://127.0.0.1:8765", "Sec-Fetch-Site": "same-origin"}, {"Sec-Fetch-Site": "none"}])
def test_own_pages_and_programs_can(client: TestClient, headers: dict[str, str]) -> None:
    assert client.post("/api/v1/projects", json={"name": "x"}, headers=headers).status_code == 201


def test_long_bodies_are_refused_before_and_while_they_come(client: TestClient) -> None:
    """With a length in front, and without one (chunked)."""
    body = b'{"name": "' + b"x" * JSON_LIMIT + b'"}'
    headers = {"Content-Type": "application/json"}
    check_problem(client.post("/api/v1/projects", content=body, headers=headers), 413, "TooLarge")
    check_problem(client.post("/api/v1/projects", content=iter([body[:500_000], body[500_000:]]), headers=headers), 413, "TooLarge")


def test_every_answer_has_the_security_headers(client: TestClient) -> None:
    for path in ("/", "/api/v1/projects", "/api/v1/nothing", "/static/css/tokens.css", "/docs"):
        headers = client.get(path).headers
        assert headers["x-content-type-options"] == "nosniff", path
        assert headers["referrer-policy"] == "same-origin"
        policy = headers["content-security-policy"]
        assert "frame-src 'self'" in policy
        assert "script-src 'self';" in policy
        assert "unsafe-eval" not in policy


def test_request_ids_are_kept_when_harmless(client: TestClient) -> None:
    assert client.get("/healthz", headers={"X-Request-ID": "abc-1"}).headers["x-request-id"] == "abc-1"
    replaced = client.get("/healthz", headers={"X-Request-ID": "a b<script>"}).headers["x-request-id"]
    assert len(replaced) == 16
