"""A sample project made once and copied for each test."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from app.settings import Settings
from app.workflow import projects, runs, tools
from app.workflow.context import Context, open_context


@pytest.fixture(scope="session")
def sample_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A closed data folder that holds the sample project."""
    folder = tmp_path_factory.mktemp("sample") / "data"
    context = open_context(Settings(data=folder, executor="inline"))
    projects.create_sample_project(context)
    context.close()
    return folder


@pytest.fixture
def sample_settings(sample_folder: Path, tmp_path: Path) -> Settings:
    """A copy of it for one test."""
    shutil.copytree(sample_folder, tmp_path / "data")
    return Settings(data=tmp_path / "data", executor="inline")


@pytest.fixture
def sample(sample_settings: Settings) -> Iterator[Context]:
    """An open context on the copy."""
    context = open_context(sample_settings)
    yield context
    context.close()


def project_of(ctx: Context) -> dict[str, Any]:
    """The only project."""
    (project,) = projects.list_projects(ctx)
    return project


def settle(ctx: Context, run: dict[str, Any]) -> dict[str, Any]:
    """The run once nothing is being computed."""
    assert ctx.jobs.wait_idle(180)
    return runs.get_run(ctx, run["id"])


def open_questions(ctx: Context, run: dict[str, Any]) -> list[dict[str, Any]]:
    """What waits for the expert."""
    return runs.list_queries(ctx, run_id=run["id"], state="open")


def tool_without_order(ctx: Context) -> dict[str, Any]:
    """The smallest tool nobody has recorded."""
    rows = [tool for tool in tools.list_tools(ctx, project_of(ctx)["id"]) if not tool["demonstrated"]]
    return min(rows, key=lambda tool: tool["region_count"])
