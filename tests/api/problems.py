"""What every refusal must look like."""

import httpx

MEMBERS = {"type", "title", "status", "detail", "error", "request_id"}


def check_problem(response: httpx.Response, status: int, error: str | None = None) -> str:
    """Assert the one error shape; returns the sentence."""
    assert response.status_code == status, f"{response.request.method} {response.url}: {response.status_code} {response.text}"
    assert response.headers["content-type"] == "application/problem+json"
    problem = response.json()
    assert set(problem) == MEMBERS
    assert problem["status"] == status
    assert problem["request_id"] == response.headers["x-request-id"] != ""
    assert problem["error"].isidentifier()
    detail = problem["detail"]
    assert len(detail.split()) >= 3, f"not a sentence: {detail!r}"
    assert detail.endswith("."), f"not a sentence: {detail!r}"
    assert "Traceback" not in detail
    assert " object at 0x" not in detail
    if error is not None:
        assert problem["error"] == error, problem
    return detail
