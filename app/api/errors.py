"""Every refusal leaves as RFC 9457 problem+json with the same members, whoever raised it.

`{"type", "title", "status", "detail", "error", "request_id"}`: `error` is the class name in app/errors.py, `detail` the
sentence for people.
"""

import logging
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import FileResponse, JSONResponse, Response
from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException
from starlette.routing import Match

from app import errors
from app.settings import ROOT

logger = logging.getLogger("apprentice.api")

MEDIA_TYPE = "application/problem+json"
METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE")

STATUS: dict[type[errors.AppError], int] = {
    errors.TooLarge: 413,
    errors.InvalidInput: 422,
    errors.NotFound: 404,
    errors.StaleVersion: 412,
    errors.Conflict: 409,
    errors.LearningFailed: 422,
    errors.RobotFailed: 422,
    errors.AppError: 400,
}

NAMES = {
    400: "BadRequest",
    403: "Forbidden",
    404: "NotFound",
    405: "MethodNotAllowed",
    413: "TooLarge",
    415: "UnsupportedMediaType",
    421: "UnknownHost",
    422: "InvalidInput",
    428: "VersionRequired",
    500: "InternalError",
}

KINDS = {
    "missing": "is missing",
    "extra_forbidden": "is not a known field",
    "json_invalid": "is not valid JSON",
    "string_too_short": "is too short",
}


class Problem(BaseModel):
    """What every error response holds."""

    type: str = Field(examples=["about:blank"])
    title: str = Field(examples=["Not Found"])
    status: int = Field(examples=[404])
    detail: str = Field(description="A sentence for people: what was wrong and what is accepted.")
    error: str = Field(description="Class name, for programs.", examples=["NotFound"])
    request_id: str = Field(description="Also in the header X-Request-ID and in the server's log.")


def status_of(error: errors.AppError) -> int:
    """The HTTP status of an application error: that of its nearest listed ancestor."""
    return next(STATUS[cls] for cls in type(error).__mro__ if cls in STATUS)


def problem_fields(status: int, name: str, detail: str, request_id: str) -> dict[str, Any]:
    """The members of a problem document."""
    title = HTTPStatus(status).phrase
    return Problem(type="about:blank", title=title, status=status, detail=detail, error=name, request_id=request_id).model_dump()


def problem(request: Request, status: int, name: str, detail: str, headers: Mapping[str, str] | None = None) -> JSONResponse:
    """A problem+json answer to `request`."""
    fields = problem_fields(status, name, detail, request_id(request))
    return JSONResponse(fields, status, headers={"X-Request-ID": fields["request_id"], **(headers or {})}, media_type=MEDIA_TYPE)


def request_id(request: Request) -> str:
    """The id the guard gave this request."""
    return getattr(request.state, "request_id", "")


def describe_validation(faults: list[Any]) -> str:
    """All validation faults as one sentence each: 'name is missing. region: Input should be ...'."""
    sentences: list[str] = []
    for fault in faults:
        place = [str(part) for part in fault["loc"]]
        field = ".".join(place[1:]) or "The request body"
        if fault["type"] == "json_invalid":
            field = "The request body"
        words = KINDS.get(fault["type"]) or f"can't be used: {fault['msg'].removeprefix('Value error, ')}"
        sentences.append(f"{field} {words}.")
    return " ".join(dict.fromkeys(sentences))


def install(app: FastAPI) -> None:
    """Register the handlers that turn exceptions into problems."""

    @app.exception_handler(errors.AppError)
    def app_error(request: Request, error: errors.AppError) -> JSONResponse:
        return problem(request, status_of(error), type(error).__name__, str(error))

    @app.exception_handler(RequestValidationError)
    def validation(request: Request, error: RequestValidationError) -> JSONResponse:
        faults = list(error.errors())
        if any(fault["loc"][:2] == ("header", "If-Match") for fault in faults):
            detail = 'This change needs the header If-Match with the version you have seen, for example If-Match: "3".'
            return problem(request, 428, NAMES[428], detail)
        return problem(request, 422, NAMES[422], describe_validation(faults))

    @app.exception_handler(HTTPException)
    def http(request: Request, error: HTTPException) -> Response:
        if error.status_code == 405:
            return _method_not_allowed(app, request)
        if error.status_code == 404 and _typed_by_a_person(request):
            return FileResponse(ROOT / "static" / "missing.html", 404, media_type="text/html")
        detail = str(error.detail)
        if error.status_code == 404 and detail == "Not Found":
            detail = f"There is nothing at {request.url.path}."
        name = NAMES.get(error.status_code, "HttpError")
        return problem(request, error.status_code, name, detail, error.headers)

    @app.exception_handler(Exception)
    def unexpected(request: Request, error: Exception) -> JSONResponse:
        logger.error("request %s %s %s failed: %r", request_id(request), request.method, request.url.path, error)
        detail = f"The server made a mistake; it is logged under request {request_id(request)}."
        return problem(request, 500, NAMES[500], detail)


def _typed_by_a_person(request: Request) -> bool:
    """Whether a browser wants to show what is at this address; programs and the page's own scripts get a problem."""
    return "text/html" in request.headers.get("accept", "") and not request.url.path.startswith(("/api/", "/static/"))


def _method_not_allowed(app: FastAPI, request: Request) -> JSONResponse:
    """405 whose Allow names the methods of all routes of the path, not only of the first one."""
    allowed = [m for m in METHODS if any(_matches(route, request, m) for route in app.routes)]
    detail = f"{request.method} is not possible here; this address knows {', '.join(allowed)}."
    return problem(request, 405, NAMES[405], detail, {"Allow": ", ".join(allowed)})


def _matches(route: Any, request: Request, method: str) -> bool:
    match, _ = route.matches({**request.scope, "method": method})
    return match is Match.FULL
