"""Study reports: listed, read, drawn; nothing outside their folder is given out, and a broken report says so."""

import json
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from app.settings import Settings
from tests.api.problems import check_problem
from tests.conftest import Api

SVG = '<svg xmlns="http://www.w3.org/2000/svg"><script>alert(1)</script></svg>'
TABLE = {"title": "Hits", "columns": ["Learner", "Hits"], "rows": [["ours", "4/4"], ["random", None]], "note": "Seed 0."}


def write_study(settings: Settings, name: str, **changes: Any) -> Path:
    folder = settings.data / "studies" / name
    folder.mkdir(parents=True)
    report = {"study": name, "title": f"All of {name}", "command": f"./dev study {name}", "made_at": "2026-01-02T03:04:05+00:00"}
    (folder / "report.json").write_text(json.dumps({**report, "tables": [TABLE], **changes}))
    (folder / "hits.svg").write_text(SVG)
    return folder


def test_no_studies_yet(api: Api, settings: Settings) -> None:
    assert api.get("/studies") == {"items": [], "next": None, "folder": str(settings.data / "studies")}


def test_studies_newest_first(api: Api, settings: Settings) -> None:
    write_study(settings, "compare")
    write_study(settings, "effort", made_at="2026-03-01T00:00:00+00:00")
    (settings.data / "studies" / "notes").mkdir()
    assert [row["name"] for row in api.get("/studies")["items"]] == ["effort", "compare"]
    first = api.get("/studies?limit=1")
    assert [row["name"] for row in api.get(f"/studies?limit=1&after={first['next']}")["items"]] == ["compare"]


def test_a_study_with_tables_and_plots(api: Api, client: TestClient, settings: Settings) -> None:
    write_study(settings, "compare")
    study = api.get("/studies/compare")
    assert study["tables"] == [TABLE]
    assert (study["plots"], study["command"], study["fault"]) == (["hits"], "./dev study compare", None)
    plot = client.get("/api/v1/studies/compare/hits.svg")
    assert (plot.status_code, plot.text, plot.headers["content-type"]) == (200, SVG, "image/svg+xml")
    assert plot.headers["x-content-type-options"] == "nosniff"
    assert "default-src 'none'" in plot.headers["content-security-policy"]
    assert "sandbox" in plot.headers["content-security-policy"], "a script in a plot that is opened by itself must not run"


@pytest.mark.parametrize(
    "address",
    [
        *("compare/other.svg", "compare/report.json", "compare/..%2Fsecret.svg", "compare/..%2F..%2Fsecret.svg", "compare/linked.svg"),
        *("../secret.svg", "..%2Fstudies%2Fcompare", "..%2F..", "%2e%2e", "compare%00", ".hidden", "away", "away/secret.svg", "missing"),
    ],
)
def test_nothing_else_is_given_out(client: TestClient, settings: Settings, address: str) -> None:
    folder = write_study(settings, "compare")
    outside = settings.data / "outside"
    outside.mkdir()
    for secret in (settings.data / "secret.svg", folder.parent / "secret.svg", outside / "secret.svg"):
        secret.write_text(SVG)
    (outside / "report.json").write_text((folder / "report.json").read_text())
    (folder / "linked.svg").symlink_to(settings.data / "secret.svg")
    (folder.parent / "away").symlink_to(outside)
    write_study(settings, ".hidden")
    answer = client.get(f"/api/v1/studies/{address}")
    check_problem(answer, 404, "NotFound")
    assert SVG not in answer.text


@pytest.mark.parametrize(
    "text",
    [
        *("no json", "[]", "{}", '{"study": "x", "title": "x", "command": "x", "made_at": "x", "tables": 3}', "\xff"),
        json.dumps({"study": "x", "title": "x", "command": "x", "made_at": "x", "tables": [{**TABLE, "rows": [["a"]]}]}),
        json.dumps({"study": "x", "title": "x", "command": "x", "made_at": "x", "tables": [{**TABLE, "rows": [["a", float("nan")]]}]}),
        json.dumps({"study": "x", "title": "x", "command": "x", "made_at": "x", "tables": [{**TABLE, "rows": [["a", {}]]}]}),
    ],
)
def test_a_broken_report_says_so(api: Api, settings: Settings, text: str) -> None:
    folder = write_study(settings, "compare")
    (folder / "report.json").write_bytes(text.encode("latin-1"))
    study = api.get("/studies/compare")
    assert "run the study again" in study["fault"]
    assert (study["tables"], study["plots"]) == ([], ["hits"])
    assert api.get("/studies")["items"][0]["fault"] == study["fault"]
