"""Files as bad luck leaves them: bytes changed, cut, repeated, numbers replaced, lines swapped."""

import re

import numpy as np

from tests.geometry.cad_files import model_of, threemf

NUMBERS = (
    b"-1",
    b"0",
    b"1e308",
    b"-1e308",
    b"1e-320",
    b"nan",
    b"inf",
    b"999999999",
    b"4294967296",
    b"1.5.2",
    b"x",
    b"",
    b"\xff",
    b"NaN(1)",
)
WORDS = (b"", b"\0", b"\r", b"\n\n", b'"', b"<!ENTITY a 'b'>", b";", b",", b"#", b"\xc3\x28", b"9" * 400)


def mutated(kind: str, content: bytes, random: np.random.Generator, most: int = 4) -> bytes:
    """One to `most` random injuries; of a 3MF mostly to the model inside it."""
    if kind == "3mf" and random.random() < 0.7:
        return threemf(_injured(model_of(content), random, most))
    return _injured(content, random, most)


def _injured(data: bytes, random: np.random.Generator, most: int) -> bytes:
    for _ in range(int(random.integers(1, most + 1))):
        injury = INJURIES[int(random.integers(len(INJURIES)))]
        data = injury(data, random) if data else data
    return data


def _place(data: bytes, random: np.random.Generator) -> int:
    return int(random.integers(len(data)))


def _flip(data: bytes, random: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for _ in range(int(random.integers(1, 9))):
        changed[_place(data, random)] = int(random.integers(256))
    return bytes(changed)


def _cut(data: bytes, random: np.random.Generator) -> bytes:
    start = _place(data, random)
    return data[:start] + data[start + int(random.integers(1, max(2, len(data) // 4))) :]


def _end(data: bytes, random: np.random.Generator) -> bytes:
    return data[: _place(data, random)]


def _repeat(data: bytes, random: np.random.Generator) -> bytes:
    start = _place(data, random)
    piece = data[start : start + int(random.integers(1, 400))]
    at = _place(data, random)
    return data[:at] + piece * int(random.integers(1, 5)) + data[at:]


def _insert(data: bytes, random: np.random.Generator) -> bytes:
    at = _place(data, random)
    return data[:at] + WORDS[int(random.integers(len(WORDS)))] + data[at:]


def _number(data: bytes, random: np.random.Generator) -> bytes:
    """Another number in place of one in the text; of a binary file, of four bytes."""
    found = list(re.finditer(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?", data[:200_000]))
    if not found or random.random() < 0.2:
        at = _place(data, random)
        return data[:at] + random.bytes(4) + data[at + 4 :]
    match = found[int(random.integers(len(found)))]
    return data[: match.start()] + NUMBERS[int(random.integers(len(NUMBERS)))] + data[match.end() :]


def _swap_lines(data: bytes, random: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    if len(lines) < 3:
        return data[::-1]
    i, j = (int(k) for k in random.integers(len(lines), size=2))
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


INJURIES = (_flip, _cut, _end, _repeat, _insert, _number, _number, _swap_lines)
