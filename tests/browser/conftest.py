"""A real Chromium on a real server with the sample project. Skipped where no Chromium is installed."""

import shutil
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from tests.browser.canvas import Studio
from tests.conftest import Api, LiveServer

SOFTWARE_RENDERING = (
    "--no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist "
    "--disable-background-networking --disable-component-update --disable-sync --no-first-run"
).split()
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
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    yield page
    page.close()
    assert errors == []


@pytest.fixture
def studio(page: Page, live_server: LiveServer, live_api: Api) -> Studio:
    """The sample project in the browser."""
    return Studio(page, live_server.address, live_api, live_api.post("/projects/sample"))
