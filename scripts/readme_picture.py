"""Take docs/record.png: the record page of a real server with 7 of 12 regions of Trough 06 recorded.

Needs the test dependencies (Playwright) and Chromium on the PATH. Run from anywhere: `python scripts/readme_picture.py`.
"""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs" / "record.png"
TOOL = "Trough 06"
ORDER = (1, 4, 7, 10, 0, 3, 6)
SIZE = (1280, 720)
PAUSE_S = 1.2  # between two clicks, so that the list shows times
START_LIMIT_S = 90
DRAW_MS = 4000  # software rendering: after the last change of the page until the 3D frame is still
CHROMIUM_ARGUMENTS = "--no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist".split()


def free_port() -> int:
    """A port nobody listens on now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def wait_until_ready(address: str, process: "subprocess.Popen[bytes]") -> None:
    """Return when the server answers; leave with a sentence when it ended or takes too long."""
    end = time.monotonic() + START_LIMIT_S
    while time.monotonic() < end:
        if process.poll() is not None:
            sys.exit("The server ended before it answered; see its output above.")
        try:
            if httpx.get(f"{address}/readyz", timeout=10).status_code == 200:
                return
        except httpx.TransportError:
            time.sleep(0.1)
    sys.exit(f"The server did not answer within {START_LIMIT_S} s.")


@contextmanager
def server() -> Iterator[str]:
    """The address of a server on a temporary data folder; stopped afterwards."""
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "app.cli", "serve", "--port", str(port), "--data", folder]
        process = subprocess.Popen(command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)})
        try:
            address = f"http://127.0.0.1:{port}"
            wait_until_ready(address, process)
            yield address
        finally:
            process.terminate()
            process.wait(30)


def record(address: str) -> str:
    """Record the first regions of the tool by REST; the path of its record page."""
    with httpx.Client(base_url=f"{address}/api/v1", timeout=120) as client:
        project = client.post("/projects/sample").raise_for_status().json()
        tools = client.get(f"/projects/{project['id']}/tools").raise_for_status().json()["items"]
        tool = next(row for row in tools if row["name"] == TOOL)
        for region in ORDER:
            client.post(f"/tools/{tool['id']}/draft/pick", json={"region": region}).raise_for_status()
            time.sleep(PAUSE_S)
    return f"/p/{project['id']}/record?tool={tool['id']}"


def take_picture(address: str, chromium: str) -> None:
    """Open the page, wait until list and 3D view are drawn, and write the picture."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=CHROMIUM_ARGUMENTS)
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]}, color_scheme="light")
        page.goto(address)
        page.locator(".view3d iframe.shown").wait_for(timeout=60_000)
        page.locator(f".seq-list li:nth-child({len(ORDER)})").wait_for()
        page.wait_for_timeout(DRAW_MS)
        page.screenshot(path=PICTURE)
        browser.close()


def main() -> None:
    """Start, record, take the picture, stop."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        sys.exit("Needs Chromium on the PATH (Debian: apt install chromium).")
    PICTURE.parent.mkdir(exist_ok=True)
    with server() as address:
        take_picture(address + record(address), chromium)


if __name__ == "__main__":
    main()
