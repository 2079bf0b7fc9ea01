"""Injured files of every format: the reader survives, and every answer is a part or a clear sentence.

200 files in every run, 2,000 per format with `-m slow`.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from app.errors import AppError, InvalidInput
from app.geometry import parser_process
from app.geometry.importing import make_part, read_file
from app.geometry.own_table import TEMPLATE_CSV, template_json
from app.geometry.region_table import read_region_table
from app.geometry.table_text import decode_table
from tests.geometry.cad_files import FILES
from tests.geometry.mutations import mutated
from tests.geometry.test_region_table import REAL, SYNTHETIC

TABLES = {"synthetic": SYNTHETIC, "real": REAL, "own csv": TEMPLATE_CSV, "own json": template_json()}
QUICK, LONG = 20, int(os.environ.get("FUZZ_FILES", "2000"))
SIGNS_OF_A_LEAK = ("Traceback", "Error", "Exception", "/tmp", "0x", "object at", "NoneType", ".py")


def check_sentence(error: AppError, name: str) -> None:
    """A refusal names the file or its row, ends with a full stop, and shows nothing of the program."""
    sentence = str(error)
    assert isinstance(error, InvalidInput)
    assert sentence.endswith("."), sentence
    assert len(sentence) < 2000, sentence
    assert sentence[0].isupper() or sentence.startswith(name.split(".")[0]), sentence
    for sign in SIGNS_OF_A_LEAK:
        assert sign not in sentence.replace(name, ""), sentence


def read_injured(kind: str, seed: int, folder: Path) -> bool:
    """Whether the injured file became a part all the same; nothing else than a refusal may happen."""
    name, content = FILES[kind]
    path = folder / "upload"
    path.write_bytes(mutated(kind, content, np.random.default_rng([seed, len(kind)])))
    try:
        parsed = read_file(path, name)
        part = make_part(parsed, parsed.units or "mm", parsed.bodies[0].up_guess)
    except AppError as error:
        check_sentence(error, name)
        return False
    assert len(part.mesh.faces) > 0
    assert np.isfinite(part.mesh.vertices).all()
    assert part.mesh.faces.max() < len(part.mesh.vertices)
    assert len(part.cad_face) == len(part.mesh.faces)
    assert part.cad_face.max() < len(part.cad_faces)
    return True


def read_injured_table(layout: str, seed: int) -> bool:
    name, content = f"{layout}.csv", TABLES[layout].encode()
    try:
        table = read_region_table(decode_table(mutated("csv", content, np.random.default_rng(seed)), name), None, name)
    except AppError as error:
        check_sentence(error, name)
        return False
    graph = table.tool.graph
    assert all(np.isfinite(getattr(graph, k)).all() for k in ("shared", "opposite", "angle", "curvature", "height", "area", "low", "high"))
    assert table.expert is None or sorted(table.expert) == list(range(table.tool.n))
    assert np.isfinite(table.tool.mesh.vertices).all()
    return True


@pytest.mark.parametrize("kind", FILES)
def test_injured_files(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parser_process, "WALL_SECONDS", 20.0)
    for seed in range(QUICK):
        read_injured(kind, seed, tmp_path)


@pytest.mark.parametrize("kind", FILES)
def test_the_whole_file_is_read(kind: str, tmp_path: Path) -> None:
    """The control: uninjured, every one of them is a part."""
    name, content = FILES[kind]
    path = tmp_path / "upload"
    path.write_bytes(content)
    parsed = read_file(path, name)
    assert parsed.bodies[0].closed
    assert len(make_part(parsed, parsed.units or "mm", "+z").mesh.faces) >= 12


@pytest.mark.parametrize("layout", TABLES)
def test_injured_tables(layout: str) -> None:
    """Some injuries are repaired or don't matter, so some are read; not all."""
    read = sum(read_injured_table(layout, seed) for seed in range(100))
    assert 0 < read < 100


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("kind", FILES)
def test_thousands_of_injured_files(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One and the same process serves all of them: it never dies with a file."""
    monkeypatch.setattr(parser_process, "WALL_SECONDS", 20.0)
    parser_process.shut_down()
    parser_process.warm_up()
    process = parser_process._idle[0]
    read = sum(read_injured(kind, seed, tmp_path) for seed in range(1000, 1000 + LONG))
    assert process.poll() is None
    assert 0 < read < LONG


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("layout", TABLES)
def test_thousands_of_injured_tables(layout: str) -> None:
    read = sum(read_injured_table(layout, seed) for seed in range(1000, 1000 + LONG))
    assert 0 < read < LONG
