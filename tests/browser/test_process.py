"""What counts, and what is shown of it: levels are set by handles; a kind of work is chosen, taken back, saved; an own feature."""

from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.browser.canvas import Studio
from tests.conftest import Api, LiveServer

pytestmark = pytest.mark.browser

OWN = """KEY, LABEL = "small_first", "Small regions first"


def values(graph, done):
    return (1 - graph.area / graph.area.max()) * (1 - done.mean(axis=1, keepdims=True))
"""


def test_situations_and_levels(desk: Studio) -> None:
    """A situation says what to do about it; thresholds are moved, kept and reset."""
    page, address = desk.page, f"/projects/{desk.project['id']}/coverage"

    def height() -> dict[str, Any]:
        return next(t for t in desk.api.get(address)["thresholds"] if t["feature"] == "height")

    usual = height()
    desk.open("coverage")
    uneven = page.locator('.cell[data-state="thin"]').first
    uneven.click()
    expect(page.locator(".situation")).to_contain_text("mostly")
    expect(page.locator(".situation")).to_contain_text("p = 0.")
    expect(page.locator(".situation")).to_contain_text("A new tool needs a region")

    page.get_by_text("Where does small end").click()
    handle = page.get_by_label("Height: large begins at")
    before = handle.get_attribute("aria-valuetext")
    handle.focus()
    handle.press("End")
    expect(handle).not_to_have_attribute("aria-valuetext", before or "")
    expect(page.get_by_text("Height is small up to")).to_be_visible()
    assert (height()["rule"], height()["low"]) == ("expert", pytest.approx(usual["low"], abs=0.01))
    assert height()["high"] == pytest.approx(usual["most"])
    page.get_by_role("button", name="Back to the usual levels of height").click()
    expect(page.get_by_text("Height has its usual levels again.")).to_be_visible()
    assert height() == usual


def test_choosing_what_counts(quiet_page: Page, server: LiveServer, api_of_all: Api, sample: dict[str, Any]) -> None:
    page, address = quiet_page, f"/projects/{sample['id']}/process"
    folder = Path(server.data) / "features"
    folder.mkdir()
    (folder / "small_first.py").write_text(OWN, encoding="utf-8")
    (folder / "wide.py").write_text(
        OWN.replace("(1 - graph", "(5 - graph").replace("small_first", "wide").replace("Small regions", "Wide ones"), encoding="utf-8"
    )
    page.goto(f"{server.address}/p/{sample['id']}/process")
    expect(page.get_by_text("between 0 and 1")).to_be_visible()
    page.get_by_role("button", name="Spraying").click()
    expect(page.get_by_text("Started from Spraying.")).to_be_visible()
    assert api_of_all.get(address)["feature_set"] == "clean~orientation"
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_label("Turn towards neighbours")).to_be_checked()
    page.get_by_label("Small regions first").click()
    expect(page.get_by_text("Small regions first counts now.")).to_be_visible()
    assert api_of_all.get(address)["feature_set"].startswith("clean+small_first@")
    page.get_by_label("Keep this choice").fill("Our layup")
    page.get_by_role("button", name="Save").click()
    expect(page.locator(".templates b", has_text="Our layup")).to_be_visible()
