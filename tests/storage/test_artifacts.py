"""Files by content, and core values in them bit for bit."""

import hashlib
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from app.errors import NotFound
from app.geometry.moulds import sample_moulds
from app.geometry.regions import measure
from app.geometry.tool import RegionGraph
from app.storage.artifacts import Artifacts
from app.storage.conversions import pack, tool_from_bytes, tool_to_bytes, unpack


def test_content_names_the_file(tmp_path: Path) -> None:
    artifacts = Artifacts(tmp_path)
    sha = artifacts.put(b"abc")
    assert sha == hashlib.sha256(b"abc").hexdigest()
    assert artifacts.get(sha) == b"abc"
    written = artifacts.path(sha).stat().st_mtime_ns
    assert artifacts.put(b"abc") == sha
    assert artifacts.path(sha).stat().st_mtime_ns == written
    assert [p.name for p in tmp_path.rglob("*") if p.is_file()] == [sha]


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(NotFound, match="0123456789ab"):
        Artifacts(tmp_path).get("0123456789ab" + "0" * 52)


def test_a_failed_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_descriptor: int) -> None:
        raise OSError("No space left on device")

    monkeypatch.setattr("app.storage.artifacts.os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        Artifacts(tmp_path).put(b"abc")
    assert [p for p in tmp_path.rglob("*") if p.is_file()] == []


def test_a_tool_survives_bit_for_bit() -> None:
    mould = sample_moulds()[3]
    tool = measure(mould.mesh, mould.labels)
    content = tool_to_bytes(tool)
    again = tool_from_bytes(content)
    assert tool_to_bytes(again) == content
    for f in fields(RegionGraph):
        a, b = getattr(tool.graph, f.name), getattr(again.graph, f.name)
        assert np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b, f.name
        assert getattr(a, "dtype", None) == getattr(b, "dtype", None), f.name
    assert np.array_equal(tool.mesh.vertices, again.mesh.vertices)
    assert np.array_equal(tool.labels, again.labels)
    for a, b in zip(tool.regions, again.regions, strict=True):
        assert (a.name, a.description, a.area, a.curvature, a.kind) == (b.name, b.description, b.area, b.curvature, b.kind)
        assert np.array_equal(a.centroid, b.centroid)


def test_pickles_are_never_loaded() -> None:
    """An object array would need pickle, which runs code."""
    words, arrays = unpack(pack({"a": 1}, x=np.arange(3)))
    assert (words, arrays["x"].tolist()) == ({"a": 1}, [0, 1, 2])
    with pytest.raises(ValueError, match="allow_pickle"):
        unpack(pack({}, x=np.array([{}], dtype=object)))
