"""What a simulated run is: body poses over time, measured force and path error, and a report per region."""

import io
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from app.errors import InvalidInput

FORMAT = 1
Faces = NDArray[np.int32]
Floats = NDArray[np.float32]
Report = Callable[[float, str], None]


def ignore(_fraction: float, _message: str) -> None:
    """A progress callback that does nothing."""


@dataclass(frozen=True)
class RegionReport:
    """How one region went."""

    region: int
    start_s: float  # first movement towards the region
    end_s: float  # roller lifted off and back at clearance height
    force_rms_n: float  # root mean square of measured minus commanded force while sweeping
    force_max_n: float  # highest measured force, touch-down and the ways in and out included
    off_path_max_mm: float  # farthest from the planned path in the tangent plane while in contact
    covered: float  # share of the region's area that the pressed roller passed over, 0..1
    problems: tuple[tuple[str, str], ...]  # (kind "reach"|"limit"|"singular"|"collision"|"contact"|"coverage", sentence)


@dataclass(frozen=True)
class Playback:
    """A simulated run in the tool frame, metres and seconds. T logged moments, B bodies."""

    times: Floats  # (T,)
    bodies: tuple[str, ...]
    positions: Floats  # (T, B, 3)
    orientations: Floats  # (T, B, 4) wxyz
    body_meshes: tuple[tuple[Floats, Faces], ...]  # per body: vertices in the body's frame (V, 3), faces (F, 3)
    joint_angles: Floats  # (T, 6) rad
    force_n: Floats  # (T,) measured along the surface normal, mean since the moment before
    off_path_mm: Floats  # (T,) 0 where the roller does not touch
    region_at: NDArray[np.int32]  # (T,) region being worked on, -1 on the way between regions
    region_reports: tuple[RegionReport, ...]  # in the order of the sequence
    cycle_s: float
    in_contact_share: float  # of the time
    force_target_n: float
    force_error_n: float  # root mean square over all regions
    covered: float  # share of the whole working surface, 0..1


_ARRAYS = ("times", "positions", "orientations", "joint_angles", "force_n", "off_path_mm", "region_at")
_NUMBERS = ("cycle_s", "in_contact_share", "force_target_n", "force_error_n", "covered")


def playback_to_bytes(playback: Playback) -> bytes:
    """A compressed npz archive without pickled objects; equal playbacks give equal bytes."""
    texts = {
        "format": FORMAT,
        "bodies": list(playback.bodies),
        "reports": [asdict(r) for r in playback.region_reports],
        **{name: getattr(playback, name) for name in _NUMBERS},
    }
    arrays: dict[str, NDArray[np.generic]] = {name: getattr(playback, name) for name in _ARRAYS}
    for i, (vertices, faces) in enumerate(playback.body_meshes):
        arrays[f"vertices_{i}"], arrays[f"faces_{i}"] = vertices, faces
    arrays["texts"] = np.frombuffer(json.dumps(texts).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)  # pyright: ignore[reportArgumentType]
    return buffer.getvalue()


def playback_from_bytes(content: bytes) -> Playback:
    """The playback that `playback_to_bytes` stored.

    Raises:
        InvalidInput: The bytes were written by another version.
    """
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        texts = json.loads(archive["texts"].tobytes())
        if texts["format"] != FORMAT:
            raise InvalidInput(f"This playback has format {texts['format']}; format {FORMAT} is read. Compute it again.")
        meshes = tuple((archive[f"vertices_{i}"], archive[f"faces_{i}"]) for i in range(len(texts["bodies"])))
        arrays = {name: archive[name] for name in _ARRAYS}
    reports = tuple(RegionReport(**{**r, "problems": tuple((p[0], p[1]) for p in r["problems"])}) for r in texts["reports"])
    numbers = {name: texts[name] for name in _NUMBERS}
    return Playback(bodies=tuple(texts["bodies"]), body_meshes=meshes, region_reports=reports, **arrays, **numbers)
