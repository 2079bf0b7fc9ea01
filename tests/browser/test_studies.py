"""The studies page: what to run while there is none, then tables, plots and commands of those that were saved."""

import json
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from app.benches.plots import Bars, bars_as_svg
from tests.conftest import LiveServer

pytestmark = pytest.mark.browser


def save(folder: Path, made_at: str, hits: list[str]) -> None:
    folder.mkdir(parents=True)
    table = {"title": "Hits", "columns": ["Learner", "Hits"], "rows": [["<i>ours</i>", hits[0]], ["random", hits[1]]], "note": "Seed 0."}
    report = {"study": folder.name, "title": f"About {folder.name}", "command": f"./dev study {folder.name}", "made_at": made_at}
    (folder / "report.json").write_text(json.dumps({**report, "tables": [table]}))


def test_studies(quiet_page: Page, server: LiveServer) -> None:
    page, place = quiet_page, Path(server.data) / "studies"
    page.goto(server.address)
    page.get_by_role("link", name="Studies").click()
    expect(page.get_by_role("heading", name="No study has been saved")).to_be_visible()
    expect(page.locator("code")).to_contain_text(f"--out {place}/compare")

    save(place / "compare", "2026-01-02T00:00:00+00:00", ["4/4", "1/4"])
    bars = Bars("Hits", "%", ("ours", "random"), {"hit": np.array([100.0, 25.0])}, {"hit": ("4/4", "1/4")})
    (place / "compare" / "hits.svg").write_text(bars_as_svg(bars))
    save(place / "effort", "2026-02-02T00:00:00+00:00", ["9/9", "2/9"])
    page.reload()
    expect(page.locator("tbody")).to_contain_text("9/9")
    expect(page.locator(".study-list button")).to_have_count(2)
    page.locator(".study-list").get_by_role("button", name="About compare").click()
    expect(page.locator("tbody tr").first).to_have_text("<i>ours</i>4/4")
    expect(page.locator("code")).to_have_text("./dev study compare")
    picture = page.get_by_role("img", name="Plot: hits")
    expect(picture).to_be_visible()
    assert picture.evaluate("async (image) => { await image.decode(); return image.naturalWidth; }") > 100
    page.reload()
    expect(page.locator("tbody")).to_contain_text("4/4")

    (place / "effort" / "report.json").write_text("{")
    page.goto(f"{server.address}/studies?study=effort")
    expect(page.get_by_role("alert")).to_contain_text("run the study again")
