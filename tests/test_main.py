"""The wiring: pages, the reference page, probes, and the command line."""

import json
import re
import socket
import subprocess
import sys
import threading
from pathlib import Path

import httpx
import pytest
from starlette.testclient import TestClient

from tests.conftest import ROOT, Api, LiveServer, free_port

PAGES = ("tools", "record", "coverage", "teach", "policy", "robot")


def test_every_page_is_served_and_its_parts_exist(client: TestClient, api: Api) -> None:
    """Scripts and styles a page names are there, and none comes from elsewhere."""
    project = api.post("/projects", {"name": "Hull"})["id"]
    for address in ("/", *(f"/p/{project}/{page}" for page in PAGES)):
        response = client.get(address)
        assert response.status_code == 200, address
        assert response.headers["content-type"].startswith("text/html")
        parts = re.findall(r'(?:src|href)="([^"#][^"]*)"', response.text)
        assert any(part.endswith(".js") for part in parts), address
        for part in parts:
            assert part.startswith("/"), f"{address} loads {part}"
            assert client.get(part).status_code == 200, f"{address} names {part}"
        assert not re.search(r"<script(?![^>]*\bsrc=)", response.text), f"{address} has an inline script, which its policy forbids"


def test_pages_of_unknown_projects_and_unknown_pages_are_404(client: TestClient) -> None:
    assert client.get("/p/nothing/tools").status_code == 404
    assert client.get("/p/nothing/other").status_code == 404


def test_a_mistyped_address_is_a_page_for_people_and_a_problem_for_programs(client: TestClient) -> None:
    for address in ("/tols", "/p/nothing/other"):
        page = client.get(address, headers={"Accept": "text/html,application/xhtml+xml"})
        assert (page.status_code, page.headers["content-type"].split(";")[0]) == (404, "text/html")
        assert client.get(address).json()["detail"] == f"There is nothing at {address}."
    assert client.get("/api/v1/tols", headers={"Accept": "text/html"}).json()["error"] == "NotFound"
    assert client.get("/p/nothing", follow_redirects=False).headers["location"] == "/p/nothing/tools"


def test_the_reference_lists_every_operation_and_loads_nothing(client: TestClient) -> None:
    page = client.get("/docs").text
    paths = client.get("/openapi.json").json()["paths"]
    for path in paths:
        assert f"<code>{path}</code>" in page
    assert page.count("<dt>") == sum(len(methods) for methods in paths.values())
    assert "<script" not in page
    assert "//" not in "".join(re.findall(r'(?:src|href)=["\']([^"\']*)', page))


def test_operations_have_their_function_as_id_and_words(client: TestClient) -> None:
    paths = client.get("/openapi.json").json()["paths"]
    operations = [operation for methods in paths.values() for operation in methods.values()]
    ids = [operation["operationId"] for operation in operations]
    assert len(set(ids)) == len(ids)
    assert all(operation["description"].endswith(".") for operation in operations)
    assert "/api/v1/projects/{project_id}/tools" in paths


def test_ready_says_what_it_looked_at(client: TestClient) -> None:
    body = client.get("/readyz").json()
    assert body["status"] == "ok"
    assert re.fullmatch(r"\d+\.\d+\.\d+", body["sqlite"])
    assert body["free_mb"] >= 100


def test_static_files_are_compressed(client: TestClient) -> None:
    response = client.get("/static/css/components.css", headers={"Accept-Encoding": "gzip"})
    assert response.headers["content-encoding"] == "gzip"


def test_closing_leaves_no_threads(settings: object) -> None:
    """Opening and closing the application twice ends with the threads it began with."""
    from app.main import create_app

    def names() -> list[str]:
        return sorted(t.name for t in threading.enumerate() if t.name != "MainThread" and not t.name.startswith(("AnyIO", "asyncio")))

    before = names()
    for _ in range(2):
        with TestClient(create_app(settings), base_url="http://127.0.0.1:1") as client:  # type: ignore[arg-type]
            assert client.get("/healthz").status_code == 200
    assert names() == before


def command(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "app.cli", *words], cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.4", "::", "example.org"])
def test_other_addresses_are_refused_without_a_login(host: str) -> None:
    done = command("serve", "--host", host)
    assert done.returncode == 2
    assert "127.0.0.1 is accepted" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_taken_port_is_said_by_serve() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        done = command("serve", "--port", str(other.getsockname()[1]))
    assert done.returncode == 2
    assert "in use" in done.stderr


def test_demo_takes_the_next_port_and_has_a_sample(tmp_path: Path) -> None:
    """The printed address answers, although the wanted port was taken; the sample project is made once only."""
    port = free_port()
    with socket.socket() as other:
        other.bind(("127.0.0.1", port))
        other.listen()
        for _ in range(2):
            words = [sys.executable, "-m", "app.cli", "demo", "--port", str(port), "--data", str(tmp_path / "data"), "--no-browser"]
            process = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True)
            try:
                assert process.stdout is not None
                line = next(line for line in process.stdout if "http://" in line)
                found = re.search(r"http://127\.0\.0\.1:(\d+)(/p/[^/]+/tools)", line)
                assert found is not None, line
                assert int(found[1]) > port
                assert httpx.get(f"http://127.0.0.1:{found[1]}{found[2]}").status_code == 200
                projects = httpx.get(f"http://127.0.0.1:{found[1]}/api/v1/projects").json()["items"]
                assert [p["sample"] for p in projects] == [True]
            finally:
                process.terminate()
                process.wait(20)
                process.stdout.close()


def test_openapi_is_what_the_server_serves(client: TestClient) -> None:
    done = command("openapi")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == client.get("/openapi.json").json()


def test_doctor_looks_at_the_data_folder(tmp_path: Path) -> None:
    done = command("doctor", "--data", str(tmp_path / "d"))
    assert f"data folder {tmp_path / 'd'} can be written" in done.stdout
    assert "SQLite" in done.stdout


def test_the_server_listens_on_loopback_only(live_server: LiveServer) -> None:
    """No socket of the process is open to the network, the 3D views' own ports included."""
    rows = [line.split() for name in ("tcp", "tcp6") for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]]
    assert live_server.process is not None
    mine = {p.readlink().name for p in Path(f"/proc/{live_server.process.pid}/fd").iterdir() if p.is_symlink()}
    addresses = {row[1].rsplit(":", 1)[0] for row in rows if row[3] == "0A" and f"socket:[{row[9]}]" in mine}
    assert addresses == {"0100007F"}
