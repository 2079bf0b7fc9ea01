"""Fixtures shared by all tests: a data folder of its own per test, the whole application on it, a real server process."""

import ctypes
import json
import os
import signal
import socket
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import pytest

from app.prepare import compile_once
from app.settings import Settings

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # starlette would like its test client on httpx2, which is not released for our pin
    from starlette.testclient import TestClient

ROOT = Path(__file__).resolve().parent.parent
SHARED = ROOT.parent / "shared"
START_LIMIT_S = 90
PARENT_DEATH_SIGNAL = 1  # PR_SET_PDEATHSIG of prctl


def pytest_sessionstart(session: pytest.Session) -> None:
    """No test's patience pays for the compiler."""
    if not session.config.option.collectonly:
        compile_once(print)


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """A data folder of its own; jobs run without worker processes."""
    return Settings(data=tmp_path / "data", executor="inline", max_upload_mb=5)


@pytest.fixture
def ctx(settings: Settings) -> Iterator[Any]:
    """The workflow context on an empty, migrated database."""
    from app.workflow.context import open_context

    context = open_context(settings)
    yield context
    context.close()


@pytest.fixture
def client(settings: Settings) -> Iterator[TestClient]:
    """A client of the whole application; what the server fails to handle becomes a 500, as in life."""
    from app.main import create_app

    with TestClient(create_app(settings), base_url="http://127.0.0.1:8765", raise_server_exceptions=False) as test_client:
        yield test_client


@dataclass
class Api:
    """Calls under /api/v1 that check the status and return the JSON."""

    client: httpx.Client
    prefix: str = "/api/v1"

    def call(self, method: str, path: str, status: int, **request: Any) -> Any:
        response = self.client.request(method, self.prefix + path, **request)
        assert response.status_code == status, f"{method} {path}: {response.status_code} {response.text}"
        return response.json() if response.content else None

    def get(self, path: str, status: int = 200, **request: Any) -> Any:
        return self.call("GET", path, status, **request)

    def post(self, path: str, body: Any = None, status: int = 201, **request: Any) -> Any:
        return self.call("POST", path, status, json=body if body is not None else {}, **request)

    def upload(self, path: str, name: str, content: bytes, status: int = 201, **fields: str) -> Any:
        return self.call("POST", path, status, files={"file": (name, content)}, data=fields)

    def delete(self, path: str, version: int, status: int = 204) -> Any:
        return self.call("DELETE", path, status, headers={"If-Match": f'"{version}"'})

    def until(self, path: str, done: Callable[[Any], bool], seconds: float = 60) -> Any:
        """GET `path` again and again until `done`."""
        end = time.monotonic() + seconds
        while True:
            row = self.get(path)
            if done(row):
                return row
            assert time.monotonic() < end, f"{path} is still {json.dumps(row)[:600]}"
            time.sleep(0.02)


@pytest.fixture
def api(client: TestClient) -> Api:
    """The REST interface of an application in this process."""
    return Api(client)


def end_with_parent() -> None:
    """In a new process: be killed when the tests end, however they end; a session of its own outlives them otherwise."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PARENT_DEATH_SIGNAL, signal.SIGKILL)


@dataclass
class LiveServer:
    """The real `serve` process on a free port; can be killed and started again on the same data."""

    data: Path
    port: int
    environment: dict[str, str] = field(default_factory=dict)
    process: subprocess.Popen[bytes] | None = None

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def log(self) -> Path:
        return self.data.parent / "server.log"

    def start(self) -> None:
        """Start the process and wait until it answers."""
        command = [sys.executable, "-m", "app.cli", "serve", "--port", str(self.port), "--data", str(self.data)]
        with self.log.open("ab") as log:
            environment = {**os.environ, **self.environment}
            self.process = subprocess.Popen(
                command, cwd=ROOT, stdout=log, stderr=log, env=environment, start_new_session=True, preexec_fn=end_with_parent
            )
        end = time.monotonic() + START_LIMIT_S
        while not self._answers():
            assert self.process.poll() is None, f"the server ended: {self.log.read_text()}"
            if time.monotonic() > end:
                self.kill()  # no fixture would: it has not been handed out yet
                raise AssertionError(f"the server does not answer: {self.log.read_text()}")
            time.sleep(0.05)

    def _answers(self) -> bool:
        try:
            return httpx.get(f"{self.address}/readyz", timeout=10).status_code == 200
        except httpx.TransportError:
            return False

    def kill(self) -> None:
        """SIGKILL to the server and its worker processes, as a power cut would."""
        self._end(signal.SIGKILL)

    def stop(self) -> int:
        """Ask the server to stop; its exit status."""
        return self._end(signal.SIGTERM)

    def _end(self, number: int) -> int:
        assert self.process is not None
        if self.process.poll() is None:
            if number == signal.SIGKILL:
                os.killpg(self.process.pid, number)
            else:
                self.process.send_signal(number)
        return self.process.wait(30)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def live_server(tmp_path: Path) -> Iterator[LiveServer]:
    """A started server."""
    server = LiveServer(tmp_path / "data", free_port())
    server.start()
    yield server
    if server.process is not None and server.process.poll() is None:
        server.kill()


@pytest.fixture
def live_api(live_server: LiveServer) -> Iterator[Api]:
    """The REST interface of the real server process."""
    with httpx.Client(base_url=live_server.address, timeout=180) as connection:
        yield Api(connection)


def shared(*parts: str) -> Path:
    """A file beside the project that is not part of it; the test is skipped where it is absent."""
    path = SHARED.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"needs {'/'.join(('../shared', *parts))}")
    return path
