"""A real Chromium on a real server with the sample project. Skipped where no Chromium is installed."""

import shutil
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from tests.browser.canvas import Studio
from tests.conftest import Api, LiveServer, free_port

SOFTWARE_RENDERING = (
    "--no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist "
    "--disable-background-networking --disable-component-update --disable-sync --no-first-run"
).split()
REFUSED = "the server responded with a status of 422"  # the browser logs every refusal, although the page says it
PATIENCE_MS = 60_000


@pytest.fixture(scope="module")  # not longer: while Playwright runs, other tests can't start an event loop
def chromium() -> Iterator[Browser]:
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if path is None:
        pytest.skip("needs Chromium (Debian: apt install chromium)")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=SOFTWARE_RENDERING)
        yield browser
        browser.close()


@pytest.fixture
def page(chromium: Browser, live_server: LiveServer) -> Iterator[Page]:
    """A page in which any script error fails the test; closed before the server stops."""
    page = chromium.new_page(viewport={"width": 1024, "height": 700})
    page.set_default_timeout(PATIENCE_MS)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" and REFUSED not in message.text else None)
    yield page
    page.close()
    assert errors == []


@pytest.fixture
def studio(page: Page, live_server: LiveServer, live_api: Api) -> Studio:
    """The sample project in the browser."""
    return Studio(page, live_server.address, live_api, live_api.post("/projects/sample"))


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveServer]:
    """One started server for all tests of a module: starting one takes longer than most of them."""
    live = LiveServer(tmp_path_factory.mktemp("server") / "data", free_port())
    live.start()
    yield live
    if live.process is not None and live.process.poll() is None:
        live.kill()


@pytest.fixture(scope="module")
def api_of_all(server: LiveServer) -> Iterator[Api]:
    """Its REST interface."""
    with httpx.Client(base_url=server.address, timeout=180) as connection:
        yield Api(connection)


@pytest.fixture(scope="module")
def sample(api_of_all: Api) -> dict[str, Any]:
    """The sample project on it."""
    return api_of_all.post("/projects/sample")


@pytest.fixture
def quiet_page(chromium: Browser, server: LiveServer) -> Iterator[Page]:
    """A page of the usual size in which script errors, but not refusals of the server, fail the test."""
    page = chromium.new_page(viewport={"width": 1280, "height": 720}, color_scheme="light")
    page.set_default_timeout(PATIENCE_MS)
    expect.set_options(timeout=PATIENCE_MS)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    page.close()
    assert errors == []


@pytest.fixture
def desk(quiet_page: Page, server: LiveServer, api_of_all: Api, sample: dict[str, Any]) -> Studio:
    """The sample project in the browser, on the module's server."""
    return Studio(quiet_page, server.address, api_of_all, sample)
