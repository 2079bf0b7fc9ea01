"""Kept machine code against changes in the files it was compiled from."""

import importlib
import sys
from pathlib import Path

import pytest

from app.geometry.compiled import _stamp

IMPORT = "from app.geometry.compiled import kernel\n\n\n"
OUTER = "from {folder}.inner import twice\n" + IMPORT + "@kernel(nogil=True)\ndef plus(x):\n    return twice(x) + 1\n"
INNER = IMPORT + "@kernel\ndef twice(x):\n    return {factor} * x\n"


def answer(folder: str) -> tuple[int, int]:
    """What the compiled function says in a fresh interpreter (nearly), and how often it came from the disk."""
    for name in [n for n in sys.modules if n.split(".")[0] == folder]:
        del sys.modules[name]
    importlib.invalidate_caches()
    _stamp.cache_clear()
    plus = importlib.import_module(f"{folder}.outer").plus
    return plus(5), sum(plus.stats.cache_hits.values())


def test_a_change_in_a_called_file_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Numba alone goes on answering 11 after the called function has changed."""
    folder = "kernels_of_a_test"
    (tmp_path / folder).mkdir()
    (tmp_path / folder / "__init__.py").write_text("")
    (tmp_path / folder / "outer.py").write_text(OUTER.format(folder=folder))
    (tmp_path / folder / "inner.py").write_text(INNER.format(factor=2))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert answer(folder) == (11, 0)
    assert answer(folder) == (11, 1)
    (tmp_path / folder / "inner.py").write_text(INNER.format(factor=3))
    assert answer(folder) == (16, 0)
