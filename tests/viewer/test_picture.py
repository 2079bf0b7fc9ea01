"""What regions look like in every mode."""

import numpy as np

from app.robot.playback import Playback, RegionReport
from app.viewer.arm import index_at, progress_at
from app.viewer.palette import LIGHT, faded, ramp, rgb
from app.viewer.picture import Picture, draft_progress, paint, sequence_progress

NAMES = ("A", "B", "C", "D")
TINTS = (0, 1, 2, 3)


def look(progress, dark: bool = False) -> Picture:
    return paint(progress, NAMES, TINTS, dark)


def test_draft_numbers_done_regions_and_letters_the_rest() -> None:
    picture = look(draft_progress([2, 0]))
    assert [(r.text, r.plate, r.outline) for r in picture.regions] == [
        ("2", True, "current"), ("B", False, None), ("1", True, None), ("D", False, None),
    ]  # fmt: skip
    assert picture.regions[2].colour == ramp(4, False)[0]
    assert picture.regions[0].colour == ramp(4, False)[1]
    assert picture.regions[1].colour == rgb(LIGHT.region_tints[1])


def test_step_hides_what_comes_later() -> None:
    texts = [[r.text for r in look(sequence_progress([3, 1, 0, 2], step)).regions] for step in (0, 2, None)]
    assert texts == [list("ABCD"), ["A", "2", "C", "1"], ["3", "2", "4", "1"]]
    outlines = [[r.outline for r in look(sequence_progress([3, 1, 0, 2], step)).regions] for step in (0, 2, None)]
    assert outlines == [[None] * 4, [None, "current", None, None], [None] * 4]


def test_regions_that_don_t_differ_are_faded_and_have_no_plate() -> None:
    picture = look(sequence_progress([3, 1, 0, 2], None, differs=[3, 1]))
    assert [(r.text, r.plate, r.outline) for r in picture.regions] == [
        ("3", False, None), ("2", True, "differs"), ("4", False, None), ("1", True, "differs"),
    ]  # fmt: skip
    assert picture.regions[0].colour == faded(ramp(4, False)[2], False)
    assert picture.regions[3].colour == ramp(4, False)[0]


def test_highlight_outlines_without_fading() -> None:
    picture = look(sequence_progress([], None, highlight=[2]))
    assert [r.outline for r in picture.regions] == [None, None, "differs", None]
    assert picture.regions[0].colour == rgb(LIGHT.region_tints[0])


def recording() -> Playback:
    """Regions 2, 0, 1 in turn, two seconds each with half a second between; region 0 has a problem."""
    times = np.arange(0, 8, 0.5, dtype=np.float32)
    reports = tuple(
        RegionReport(region, 2.5 * k, 2.5 * k + 2, 0, 0, 0, 1, (("reach", "Too far."),) if region == 0 else ())
        for k, region in enumerate((2, 0, 1))
    )
    at = np.full(len(times), -1, np.int32)
    for report in reports:
        at[(times >= report.start_s) & (times < report.end_s)] = report.region
    k = len(times)
    still = np.zeros((k, 2, 3), np.float32)
    still[:, 1, 0] = times
    turn = np.tile(np.array([1, 0, 0, 0], np.float32), (k, 2, 1))
    shape = (np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
    flat = np.zeros(k, np.float32)
    return Playback(
        times, ("base", "roller"), still, turn, (shape, shape), np.zeros((k, 6), np.float32), flat, flat, at, reports, 7.5, 0.8, 20, 0, 1
    )


def test_regions_are_done_as_the_robot_proceeds() -> None:
    playback = recording()
    assert index_at(playback, 0.49) == 0
    assert index_at(playback, 0.5) == 1
    assert index_at(playback, 99) == len(playback.times) - 1
    during, between = progress_at(playback, 3.0), progress_at(playback, 2.2)
    assert (during.sequence, during.done, during.current) == ((2, 0, 1), 2, 0)
    assert (between.done, between.current) == (1, None)
    assert [r.outline for r in look(during).regions] == ["current", None, None, None]
    assert [r.outline for r in look(between).regions] == ["conflict", None, None, None]
