"""Compiling beforehand: once per state of the sources, and never in the way of a start."""

from pathlib import Path

import pytest

from app import prepare


@pytest.fixture
def stamp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(prepare, "STAMP", tmp_path / "kept" / "compiled")
    return prepare.STAMP


def test_it_compiles_once_and_again_when_the_sources_are_others(stamp: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prepare, "COMPILE", "{share!r}")
    said: list[str] = []
    prepare.compile_once(said.append)
    prepare.compile_once(said.append)
    assert len(said) == 1
    stamp.write_text("of older sources")
    prepare.compile_once(said.append)
    assert len(said) == 2
    assert stamp.read_text() == prepare.sources_digest()


def test_a_failure_is_said_and_tried_again(stamp: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prepare, "COMPILE", "raise SystemExit(1)  # {share}")
    said: list[str] = []
    prepare.compile_once(said.append)
    assert "Not everything" in said[1]
    assert not stamp.exists()
