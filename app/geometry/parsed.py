"""What a parser found in a file: all triangles, the bodies they form, the CAD faces; nothing repaired yet."""

import io
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from app.errors import InvalidInput
from app.geometry.cad_faces import CadFace
from app.geometry.tool import Array

ALL = "all"  # the choice of every body instead of one


@dataclass(frozen=True)
class Body:
    """One connected piece of a file."""

    name: str
    extents: tuple[float, float, float]  # file units
    faces: int  # triangles
    area: float  # file units squared
    closed: bool
    up_guess: str  # "+x" ... "-z"


@dataclass(frozen=True)
class ParsedFile:
    """A file's geometry in its own units and frame."""

    vertices: Array  # (V, 3)
    faces: NDArray[np.int64]  # (F, 3)
    cad_face: NDArray[np.int64]  # (F,) index into cad_faces, -1 without
    body: NDArray[np.int64]  # (F,) index into bodies, -1 for pieces too small to matter
    bodies: tuple[Body, ...]  # largest area first
    cad_faces: tuple[CadFace, ...]
    units: str | None  # "m", "mm", "cm", "in" where the file or its format says it
    skipped: int  # entries that are lines or points
    specks: int  # pieces that are no body of their own

    def chosen(self, body: str | None) -> list[int]:
        """Indices of the bodies that `body` ("1", "2", ... or "all"; None: the guess) asks for.

        Raises:
            InvalidInput: There is no such body.
        """
        body = self.guess if body is None else body
        if body == ALL:
            return list(range(len(self.bodies)))
        if not body.isascii() or not body.isdigit() or not 1 <= int(body) <= len(self.bodies):
            known = f"1 to {len(self.bodies)}" if len(self.bodies) > 1 else "1"
            raise InvalidInput(f"There is no body {body!r} in the file. Choose {known}, or {ALL}.")
        return [int(body) - 1]

    @property
    def guess(self) -> str:
        """The largest body; all of them where the largest is an open piece with less than half of the surface."""
        whole = sum(body.area for body in self.bodies)
        first = self.bodies[0]
        return "1" if first.closed or 2 * first.area >= whole else ALL

    def to_bytes(self) -> bytes:
        """The file as an .npz."""
        words = {
            "bodies": [asdict(body) for body in self.bodies],
            "cad_faces": cad_faces_to_json(self.cad_faces),
            **{name: getattr(self, name) for name in ("units", "skipped", "specks")},
        }
        stored = io.BytesIO()
        text = np.frombuffer(json.dumps(words).encode(), np.uint8)
        arrays = {name: getattr(self, name).astype(np.int32) for name in ("faces", "cad_face", "body")}
        np.savez(stored, words=text, vertices=self.vertices, **arrays)
        return stored.getvalue()

    @staticmethod
    def from_bytes(content: bytes) -> "ParsedFile":
        """The file that `to_bytes` stored; never runs code from it."""
        with np.load(io.BytesIO(content), allow_pickle=False) as stored:
            a = {name: stored[name] for name in stored.files}
        words = json.loads(a["words"].tobytes())
        bodies = tuple(Body(**{**body, "extents": tuple(body["extents"])}) for body in words.pop("bodies"))
        faces = cad_faces_from_json(words.pop("cad_faces"))
        whole = {name: a[name].astype(np.int64) for name in ("faces", "cad_face", "body")}
        return ParsedFile(a["vertices"], bodies=bodies, cad_faces=faces, **whole, **words)


def cad_faces_to_json(faces: Sequence[CadFace]) -> list[dict[str, object]]:
    """CAD faces as JSON objects; fields without a value are left out."""
    return [{k: v for k, v in asdict(face).items() if v is not None} for face in faces]


def cad_faces_from_json(rows: Sequence[dict[str, object]]) -> tuple[CadFace, ...]:
    """CAD faces from JSON objects with the names of their fields."""
    return tuple(CadFace(**{k: tuple(v) if isinstance(v, list) else v for k, v in row.items()}) for row in rows)  # pyright: ignore[reportArgumentType]
