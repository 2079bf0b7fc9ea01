"""A served hub on a workflow in memory."""

from collections.abc import Iterator

import pytest

from app.viewer.hub import Hub
from tests.viewer.fakes import FakeWorkflow, Served, serve


@pytest.fixture
def workflow() -> FakeWorkflow:
    return FakeWorkflow()


@pytest.fixture
def served(workflow: FakeWorkflow) -> Iterator[Served]:
    running = serve(Hub(None, workflow.actions()))
    yield running
    running.stop()
