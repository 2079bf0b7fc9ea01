"""Is the server alive, and is it ready to work?"""

import shutil
import sqlite3

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse

from app.api.dependencies import Ctx, Row
from app.api.errors import problem

router = APIRouter(tags=["server"])

LEAST_FREE_MB = 100


class Health(Row):
    """The process answers."""

    status: str


class Readiness(Row):
    """The parts the server needs."""

    status: str
    database: str
    sqlite: str
    free_mb: int


@router.get("/healthz")
def healthz() -> Health:
    """The process runs; looks at nothing else."""
    return Health(status="ok")


@router.get("/readyz", response_model=Readiness, responses={503: {"description": "Not ready."}})
def readyz(request: Request, ctx: Ctx) -> Readiness | JSONResponse:
    """The database answers and there is room to write."""
    ctx.store.read(lambda session: session.connection().exec_driver_sql("SELECT 1").scalar())
    free_mb = shutil.disk_usage(ctx.settings.data).free // 1_000_000
    if free_mb < LEAST_FREE_MB:
        return problem(request, 503, "NotReady", f"Only {free_mb} MB are free on the disk of the data folder.")
    return Readiness(status="ok", database="ok", sqlite=sqlite3.sqlite_version, free_mb=free_mb)
