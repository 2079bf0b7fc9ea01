"""Bars of measured figures."""

import json
from pathlib import Path

from typer.testing import CliRunner

from app.benches.figures import Figure, as_json, as_line, grouped
from app.cli import app


def test_a_bar_can_be_met_and_missed_from_either_side() -> None:
    assert Figure("g", "time", 2.0, bar=1.0).met is False
    assert Figure("g", "time", 1.0, bar=1.0).met is True
    assert Figure("g", "hits", 2.0, bar=3.0, sense="at least").met is False
    assert Figure("g", "hits", 3.0, bar=3.0, sense="at least").met is True
    assert Figure("g", "time", 2.0).met is None


def test_a_line_shows_value_bar_and_ratio() -> None:
    assert as_line(Figure("g", "N = 12", 0.05, "ms", bar=0.1)).split() == ["ok", "N", "=", "12", "0.05", "ms", "at", "most", "0.1", "x0.5"]
    assert as_line(Figure("g", "N = 12", 0.2, "ms", bar=0.1)).startswith("MISSED")


def test_groups_get_one_heading_each() -> None:
    lines = list(grouped(iter([Figure("a", "1", 1), Figure("a", "2", 2), Figure("b", "3", 3)])))
    assert [line for line in lines if line.startswith("\n")] == ["\na", "\nb"]


def test_json_says_whether_the_bar_is_met() -> None:
    assert as_json([Figure("g", "time", 2.0, bar=1.0)])[0]["met"] is False


def test_the_command_prints_and_saves(tmp_path: object) -> None:
    target = f"{tmp_path}/figures.json"
    result = CliRunner().invoke(app, ["bench", "sequencing", "--quick", "--json", target])
    saved = json.loads(Path(target).read_text(encoding="utf-8"))
    assert saved
    assert all(figure["name"] in result.output for figure in saved)
