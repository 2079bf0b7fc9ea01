"""Our page is the installed viser's page, and everything we change in it is still there to be changed."""

import gzip
import re
from pathlib import Path

import pytest
import viser

from app.viewer.page import PARAMETERS, POLICY, viewer_page
from app.viewer.shaders import CHANGES, COLOURS, LINES, Change

CLIENT = Path(viser.__file__).parent / "client"


def test_script_comes_before_everything_else_in_the_head() -> None:
    plain, packed = viewer_page()
    assert gzip.decompress(packed) == plain
    assert plain.index(b"document.hasFocus") < plain.index(b"<meta")
    assert plain.count(b"<head>") == 1


def test_dangerous_parameters_are_not_allowed() -> None:
    source = "".join(path.read_text() for path in (CLIENT / "src").rglob("*.ts*"))
    known = set(re.findall(r'searchParams\.(?:get|has)\("(\w+)"\)|searchParamKey = "(\w+)"', source))
    names = {first or second for first, second in known}
    assert {"websocket", "playbackPath"} <= names, "viser names them otherwise now"
    assert not {"websocket", "playbackPath"} & PARAMETERS
    assert "connect-src 'self' data: blob:" in POLICY


@pytest.mark.parametrize("change", [c for c in CHANGES if c not in (*COLOURS, *LINES)], ids=lambda c: c.old)
def test_changed_lines_exist_in_viser_s_label_shaders(change: Change) -> None:
    source = (CLIENT / "src" / "label" / "LabelRenderer.tsx").read_text()
    assert change.old in source
    assert change.mark in source


def test_panels_we_hide_are_marked_as_we_expect() -> None:
    source = "".join(path.read_text() for path in (CLIENT / "src").rglob("*.tsx"))
    assert "data-floating-window" in source
