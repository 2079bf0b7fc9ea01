"""What the server must refuse, each with a sentence that says what was wrong and what is accepted."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from starlette.testclient import TestClient

from tests.api.files import REAL_TABLE, SIDE_MISSING, STEP, THREE_SIDES, binary_stl, multipart, tetrahedron, zip_bomb
from tests.api.problems import check_problem
from tests.conftest import Api, LiveServer, shared


@pytest.fixture
def project(api: Api) -> str:
    return api.post("/projects", {"name": "Bad input"})["id"]


def refused_upload(client: TestClient, project: str, name: str, content: bytes, status: int = 422) -> str:
    """Upload, expect a refusal that leaves no tool behind; returns the sentence."""
    response = client.post(f"/api/v1/projects/{project}/tools", files={"file": (name, content)})
    detail = check_problem(response, status)
    assert client.get(f"/api/v1/projects/{project}/tools").json()["items"] == []
    return detail


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("empty.stl", b"", ["empty.stl", "empty"]),
        ("notes.txt", b"no part", ["notes.txt", ".step", ".stl", ".3mf"]),
        ("noname", b"no part", [".step"]),
        ("part.step", STEP, ["part.step", "truncated"]),
        ("flat.stl", binary_stl([]), ["no triangles"]),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", ["no faces"]),
        ("nan.stl", tetrahedron(float("nan")), ["not numbers"]),
        ("nan.obj", b"v 0 0 0\nv 1 0 nan\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n", ["not numbers"]),
        ("picture.stl", b"\x89PNG\r\n\x1a\n" + b"\0" * 200, ["picture.stl", "PNG"]),
    ],
    ids=["empty", "extension", "no-extension", "truncated-step", "no-triangles", "points-only", "nan-stl", "nan-obj", "picture"],
)
def test_unusable_files_are_refused_in_words(client: TestClient, project: str, name: str, content: bytes, words: list[str]) -> None:
    detail = refused_upload(client, project, name, content)
    for word in words:
        assert word in detail


def test_a_soup_of_triangles_is_refused(client: TestClient, project: str) -> None:
    detail = refused_upload(client, project, "soup.stl", shared("cad", "soup.stl").read_bytes())
    assert "surface" in detail


def test_a_zip_bomb_is_refused_without_unpacking_it(client: TestClient, project: str) -> None:
    bomb = zip_bomb(300)
    assert len(bomb) < 400_000
    detail = refused_upload(client, project, "bomb.3mf", bomb, status=413)
    assert "unpacks" in detail
    assert "300 MB" in detail or "286 MB" in detail


def test_names_are_never_paths(client: TestClient, project: str, settings: object) -> None:
    """A name with folders keeps its last part and writes nowhere else."""
    response = client.post(f"/api/v1/projects/{project}/tools", files={"file": ("../../../evil.stl", tetrahedron())})
    assert response.status_code == 201
    assert response.json()["file_name"] == "evil.stl"


def test_files_over_the_limit_are_refused(client: TestClient, project: str) -> None:
    """This server takes 5 MB; the sentence names the limit. With and without a stated length."""
    detail = refused_upload(client, project, "big.stl", b"\0" * 6_000_000, status=413)
    assert "5 MB" in detail

    def chunks() -> Iterator[bytes]:
        yield from multipart("big.stl", 6_000_000)

    headers = {"Content-Type": "multipart/form-data; boundary=b"}
    response = client.post(f"/api/v1/projects/{project}/tools", content=chunks(), headers=headers)
    assert "5 MB" in check_problem(response, 413, "TooLarge")


def test_300_megabytes_are_refused_while_they_stream(live_server: LiveServer, live_api: Api) -> None:
    """The real server with its real limit of 200 MB; without a length it has to notice by itself, and keeps nothing."""
    project = live_api.post("/projects", {"name": "Big"})["id"]
    headers = {"Content-Type": "multipart/form-data; boundary=b"}
    address = f"/api/v1/projects/{project}/tools"
    response = live_api.client.post(address, content=multipart("big.stl", 300_000_000), headers=headers)
    assert "200 MB" in check_problem(response, 413, "TooLarge")
    assert live_api.get("/projects")["items"][0]["id"] == project
    assert stored_bytes(live_server.data) < 5_000_000


def stored_bytes(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def test_a_malformed_region_table_names_row_and_value(client: TestClient, project: str) -> None:
    """One row that lacks a whole side."""
    files = {"file": ("Mold_13_Data.csv", SIDE_MISSING.encode())}
    detail = check_problem(client.post(f"/api/v1/projects/{project}/tools/region-table", files=files), 422, "MalformedTable")
    for word in ("Row d", "b,x,O,x,c", "3 sides", "4"):
        assert word in detail
    assert client.get(f"/api/v1/projects/{project}/tools").json()["items"] == []


def test_a_missing_separator_is_put_in_where_the_neighbours_say_and_told(api: Api, project: str) -> None:
    tool = api.upload(f"/projects/{project}/tools/region-table", "Mold_13_Data.csv", THREE_SIDES.encode())
    told = (
        "Row d: 'b,x,O,O,x,c' in 'neighbors' lists 3 sides instead of 4; read as 'b,x,O,x,O,x,c', which agrees with the neighbours' rows."
    )
    assert tool["report"] == [{"level": "repaired", "text": told}]
    assert api.get(f"/demonstrations/{tool['demonstration_id']}")["sequence"] == [0, 1, 3, 2]


def test_the_templates_are_tools(api: Api, client: TestClient, project: str) -> None:
    """Download, upload again: a tool with a demonstration and nothing to complain about; both formats are the same tool."""
    regions = []
    for form in ("csv", "json"):
        response = client.get(f"/api/v1/region-table-template?format={form}")
        assert response.status_code == 200
        assert response.headers["content-disposition"] == f'attachment; filename="region-table.{form}"'
        tool = api.upload(f"/projects/{project}/tools/region-table", f"template.{form}", response.content)
        assert (tool["region_count"], tool["demonstrated"], tool["report"], tool["feature_set"]) == (4, True, [], "clean")
        regions.append(api.get(f"/tools/{tool['id']}/regions")["items"])
    assert regions[0] == regions[1]
    check_problem(client.get("/api/v1/region-table-template?format=xlsx"), 422)


def test_a_sound_region_table_brings_its_demonstration(api: Api, project: str) -> None:
    tool = api.upload(f"/projects/{project}/tools/region-table", "Mold_1_Data.csv", REAL_TABLE.encode())
    assert (tool["kind"], tool["state"], tool["region_count"], tool["demonstrated"]) == ("table", "ready", 4, True)
    demonstration = api.get(f"/demonstrations/{tool['demonstration_id']}")
    assert (demonstration["sequence"], demonstration["source"]) == ([0, 1, 3, 2], "table")


@pytest.mark.parametrize(
    ("name", "content", "word"),
    [("table.csv", b"", "empty"), ("table.csv", b"\xff\xfe\x00", "UTF-8"), ("table.csv", b"a,b\n1,2\n", "header")],
    ids=["empty", "binary", "other-table"],
)
def test_other_files_are_no_region_table(client: TestClient, project: str, name: str, content: bytes, word: str) -> None:
    response = client.post(f"/api/v1/projects/{project}/tools/region-table", files={"file": (name, content)})
    assert word in check_problem(response, 422, "MalformedTable")


@pytest.mark.parametrize(
    ("sequence", "word"),
    [([0, 1, 2], "D"), ([], "A"), ([0, 1, 2, 3, 3], "D"), ([0, 1, 2, 2], "C"), ([0, 1, 2, 7], "7")],
    ids=["incomplete", "empty", "repeating", "repeating-and-incomplete", "unknown-region"],
)
def test_sequences_must_hold_every_region_once(client: TestClient, api: Api, project: str, sequence: list[int], word: str) -> None:
    tool = api.upload(f"/projects/{project}/tools/region-table", "t.csv", REAL_TABLE.encode())
    response = client.post(f"/api/v1/tools/{tool['id']}/demonstrations", json={"sequence": sequence})
    assert word in check_problem(response, 422, "IncompleteSequence")
    assert len(api.get(f"/tools/{tool['id']}/demonstrations")["items"]) == 1


def waiting_run(api: Api) -> tuple[dict, list[dict]]:
    """A performance run of the sample project that asks something."""
    project = api.post("/projects/sample")["id"]
    run = api.post(f"/projects/{project}/runs", {"kind": "performance", "mode": "paper", "seed": 7}, status=202)
    run = api.until(f"/runs/{run['id']}", lambda row: row["state"] not in ("queued", "training"))
    assert run["state"] == "waiting_for_expert", run
    return run, api.get(f"/runs/{run['id']}/queries", params={"state": "open"})["items"]


def test_queries_are_answered_once_and_hold_their_tools(client: TestClient, api: Api) -> None:
    """Two clients at once: one answer counts; later ones, answers of the wrong kind and deleting the tool are refused."""
    run, queries = waiting_run(api)
    address = f"/api/v1/queries/{queries[0]['id']}/answer"
    assert "similar" in check_problem(client.post(address, json={"value": "left"}), 422)

    tool = api.get(f"/tools/{queries[0]['tool_id']}")
    headers = {"If-Match": f'"{tool["version"]}"'}
    check_problem(client.delete(f"/api/v1/tools/{tool['id']}", headers=headers), 409, "RunActive")
    assert api.get(f"/tools/{tool['id']}")["state"] == "ready"

    replies: list[httpx.Response] = []
    threads = [
        threading.Thread(target=lambda v=v: replies.append(client.post(address, json={"value": v}))) for v in ("similar", "not_similar")
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    first, second = sorted(replies, key=lambda r: r.status_code)
    assert first.status_code == 201
    check_problem(second, 409, "AlreadyAnswered")
    assert api.get(f"/queries/{queries[0]['id']}")["answer"]["value"] == first.json()["value"]

    check_problem(client.post(address, json={"value": "similar"}), 409, "AlreadyAnswered")
    api.post(f"/runs/{run['id']}/cancel", status=202)
    api.until(f"/runs/{run['id']}", lambda row: row["state"] == "cancelled")
    for query in queries[1:]:
        check_problem(client.post(f"/api/v1/queries/{query['id']}/answer", json={"value": "similar"}), 409)
    api.delete(f"/tools/{tool['id']}", api.get(f"/tools/{tool['id']}")["version"])


def test_refusals_are_quick(client: TestClient, project: str) -> None:
    """A wrong extension needs no parser."""
    begin = time.monotonic()
    refused_upload(client, project, "notes.txt", b"no part")
    assert time.monotonic() - begin < 2
