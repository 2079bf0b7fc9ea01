"""create_app(): the one place that wires the parts together."""

import asyncio
import gc
import weakref
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any
from urllib.parse import quote

from fastapi import APIRouter, FastAPI, Request
from fastapi.responses import FileResponse, RedirectResponse, Response
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import GZipMiddleware
from starlette.staticfiles import StaticFiles

from app.api import (
    coverage,
    demonstrations,
    drafts,
    errors,
    events,
    experts,
    playbacks,
    policies,
    process,
    projects,
    queries,
    reference,
    runs,
    segmentations,
    server,
    sessions,
    studies,
    tools,
)
from app.api.guard import Guard
from app.errors import NotFound
from app.settings import ROOT, Settings
from app.viewer import Hub
from app.workflow.context import open_context
from app.workflow.projects import get_project

VERSION = "0.1.0"
STATIC = ROOT / "static"
HOSTS = ("127.0.0.1", "localhost", "::1")
NOUNS = (
    projects,
    tools,
    segmentations,
    drafts,
    demonstrations,
    experts,
    coverage,
    process,
    runs,
    queries,
    policies,
    playbacks,
    studies,
    sessions,
    events,
)
PAGES = ("tools", "record", "process", "coverage", "teach", "policy", "robot")
DESCRIPTION = "Learns in which order an expert works on the regions of a part, and shows a robot doing it on another part."
PROBLEMS: dict[int | str, dict[str, Any]] = {
    "4XX": {"model": errors.Problem, "description": "Refused; the body says why and what is accepted."},
    "5XX": {"model": errors.Problem, "description": "The server failed."},
}


def create_app(settings: Settings) -> FastAPI:
    """The whole application on `settings`: the database is migrated and opened, unfinished work goes on."""
    context = open_context(settings)
    hub = Hub(context)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        loop = asyncio.get_running_loop()
        app.state.streams = events.Streams(context.store, loop)
        hub.start(loop)
        gc.freeze()  # what is loaded by now stays: looking for garbage among it would hold up somebody's request
        try:
            yield
        finally:
            app.state.streams.close()
            await asyncio.to_thread(hub.close)
            await asyncio.to_thread(context.close)

    app = FastAPI(
        title="Apprentice",
        version=VERSION,
        description=DESCRIPTION,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.context = context
    app.state.idempotency_locks = weakref.WeakValueDictionary()
    errors.install(app)
    for noun in NOUNS:
        app.include_router(noun.router, prefix="/api/v1", responses=PROBLEMS)
    app.include_router(server.router)
    app.include_router(reference.router)
    app.include_router(hub.router)
    app.include_router(pages)
    app.mount("/static", StaticFiles(directory=STATIC), name="static")
    app.add_middleware(GZipMiddleware, compresslevel=5)
    app.add_middleware(Guard, hosts=HOSTS, max_upload_mb=settings.max_upload_mb)
    return app


pages = APIRouter(include_in_schema=False)


@pages.get("/")
def projects_page() -> Response:
    """The list of projects."""
    return page_file("projects")


@pages.get("/studies")
def studies_page() -> Response:
    """The study reports."""
    return page_file("studies")


@pages.get("/p/{project_id}")
def first_page(project_id: str) -> Response:
    """A project's address without a page leads to its tools."""
    return RedirectResponse(f"/p/{quote(project_id)}/tools")


@pages.get("/p/{project_id}/{page}")
def project_page(project_id: str, page: str, request: Request) -> Response:
    """One of a project's pages. For a project that doesn't exist the page itself says so; only the status differs."""
    if page not in PAGES:
        raise HTTPException(404)
    try:
        get_project(request.app.state.context, project_id)
    except NotFound:
        return page_file(page, status=404)
    return page_file(page)


@pages.get("/favicon.ico")
def favicon() -> Response:
    """Browsers ask for it unbidden."""
    return FileResponse(STATIC / "icon.svg", media_type="image/svg+xml")


def page_file(name: str, status: int = 200) -> Response:
    """A page of ours, looked at anew by the browser each time."""
    return FileResponse(STATIC / f"{name}.html", status, media_type="text/html", headers={"Cache-Control": "no-cache"})
