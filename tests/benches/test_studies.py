"""The study commands: what they print and save."""

import json
import xml.etree.ElementTree as ET
from pathlib import Path

from typer.testing import CliRunner

from app.cli import app
from tests.conftest import shared


def run(*words: str) -> str:
    result = CliRunner().invoke(app, ["study", *words, "--data", str(shared("datasets", "authors"))])
    assert result.exit_code == 0, result.output
    return result.output


def test_coverage_prints_ours_beside_the_published_numbers(tmp_path: Path):
    text = run("coverage", "--out", str(tmp_path))
    assert "can't be recomputed" in text
    saved = json.loads((tmp_path / "coverage.json").read_text())
    assert [r["published"] for r in saved["synthetic"]] == [1.0, 0.9, 0.5, 0.4]
    for row in saved["synthetic"] + saved["real"]:
        assert row["strict"] == row["captured"] / row["possible"] <= row["plain"] == row["shown"] / row["possible"]
    assert saved["synthetic"][0]["plain"] == max(r["plain"] for r in saved["synthetic"])


def test_effort_is_never_worse_after_learning(tmp_path: Path):
    run("effort", "--out", str(tmp_path))
    rows = json.loads((tmp_path / "effort.json").read_text())
    assert len(rows) == 10
    assert all(r[part]["after"] >= r[part]["before"] for r in rows for part in ("trained", "unseen"))
    assert sum(r["unseen"]["after"] for r in rows) >= sum(r["unseen"]["before"] for r in rows) + 4
    assert max(r["answers"] for r in rows) <= 5


def test_ablation_saves_three_plots(tmp_path: Path):
    run("ablation", "--out", str(tmp_path), "--seeds", "2")
    names = sorted(p.name for p in tmp_path.glob("*.svg"))
    assert names == ["ablation_shift.svg", "ablation_spread.svg", "ablation_violations.svg"]
    for name in names:
        root = ET.fromstring((tmp_path / name).read_text())
        assert len(root.findall("{http://www.w3.org/2000/svg}polyline")) == 4


def test_every_saved_study_has_a_report(tmp_path: Path):
    """The tables that were printed, in words, with the command that makes them again."""
    run("coverage", "--out", str(tmp_path / "c"))
    report = json.loads((tmp_path / "c" / "report.json").read_text())
    assert report["command"].startswith("./dev study coverage --data ")
    assert report["command"].endswith(f"--out {tmp_path / 'c'}")
    assert [row[1] for row in report["tables"][0]["rows"]] == ["1.00", "0.90", "0.50", "0.40"]
    run("real", "--out", str(tmp_path / "r"))
    short, tools = json.loads((tmp_path / "r" / "report.json").read_text())["tables"]
    assert [row[0] for row in tools["rows"]] == list(range(1, 11))
    unseen = [row[3] for row in tools["rows"] if row[2] == "unseen"]
    assert short["rows"][0][-1] == f"{unseen.count('yes')}/{len(unseen)}"
    assert all(len(row) == len(table["columns"]) for table in (short, tools) for row in table["rows"])
