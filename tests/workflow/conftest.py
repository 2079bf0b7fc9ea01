"""A sample project made once and copied for each test."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from app.settings import Settings
from app.workflow import projects
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
