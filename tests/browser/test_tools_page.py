"""What an engineer does on the tools page: a file dropped, cut, corrected in the 3D view, and everything taken back after a reload."""

import base64
import io

import numpy as np
import pytest
import trimesh
from PIL import Image
from playwright.sync_api import FloatRect, Page, expect

from app.geometry.moulds import sample_moulds
from tests.browser.canvas import Studio, sample_tool
from tests.conftest import Api, LiveServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

DROP = """([content, name]) => {
  const bytes = Uint8Array.from(atob(content), (letter) => letter.charCodeAt(0));
  const carried = new DataTransfer();
  carried.items.add(new File([bytes], name));
  const main = document.querySelector("main");
  const about = { bubbles: true, cancelable: true, dataTransfer: carried };
  for (const type of ["dragenter", "dragover", "drop"]) main.dispatchEvent(new DragEvent(type, about));
}"""


def editing(studio: Studio, name: str) -> tuple[dict, np.ndarray]:
    """The tool's row, and the pixels of its regions once they are drawn."""
    row = studio.tool(name)
    studio.open("tools", tool=row["id"])
    studio.page.locator(".view3d iframe.shown").wait_for()
    studio.page.locator("tr[data-region]").first.wait_for()
    pixels = studio.region_pixels(sample_tool(name))
    studio.wait_for_regions(pixels)
    return row, pixels


def selected(page: Page) -> list[str]:
    return page.locator("tr[aria-selected=true] .rename-text").all_inner_texts()


def wait_for_count(studio: Studio, tool_id: str, count: int) -> dict:
    """Until server and page have that many regions."""
    tool = studio.api.until(f"/tools/{tool_id}", lambda row: row["region_count"] == count)
    expect(studio.page.locator("[data-key=tab-regions]")).to_have_text(f"{count} regions")
    return tool


def wait_for_step(studio: Studio, tool_id: str, step: int) -> None:
    """Until server and page, whose history is open, stand at that step."""
    studio.api.until(f"/tools/{tool_id}", lambda row: row["edit"]["step"] == step)
    expect(studio.page.locator(".history-list li").nth(step)).to_have_class("now")


def between(pixels: np.ndarray, region: int, towards: int, share: float = 0.25) -> np.ndarray:
    """A pixel on `region`, on the way from its label to that of a neighbour."""
    return pixels[region] + share * (pixels[towards] - pixels[region])


def enter(page: Page, keys: str, hint: str) -> None:
    """Choose a mode, and wait until the view knows it too: a click before that would select."""
    with page.expect_response(lambda answer: answer.url.endswith("/scene") and answer.request.method == "PATCH"):
        page.keyboard.press(keys)
    expect(page.locator(".edit-hint")).to_contain_text(hint)


def click_points(page: Page, *pixels: np.ndarray) -> None:
    """Click each until the hint asks for the next: right after an edit the browser may still be building the new regions."""
    hint = page.locator(".edit-hint")
    for pixel in pixels:
        before = hint.inner_text()
        for attempt in range(8):
            page.mouse.click(*(pixel + attempt))  # a late first click and this one give the same line
            try:
                expect(hint).not_to_have_text(before, timeout=8_000)
                break
            except AssertionError:
                continue


def test_edits_in_the_view_and_undo_after_a_reload(desk: Studio) -> None:
    """Trough 06: three columns, four rows; E (4) is the floor's second row, between D (3) and F (5)."""
    page = desk.page
    row, pixels = editing(desk, "Trough 06")

    page.mouse.move(*pixels[4])  # what lies under the pointer is marked in the table
    expect(page.locator("tr[data-region='4'][data-hover]")).to_have_count(1)
    page.mouse.click(*pixels[4])
    expect(page.locator("tr[data-region='4'][aria-selected=true]")).to_have_count(1)
    page.keyboard.down("Shift")
    page.mouse.click(*pixels[3])
    page.keyboard.up("Shift")
    expect(page.locator("tr[aria-selected=true]")).to_have_count(2)

    page.keyboard.press("Shift+M")
    wait_for_count(desk, row["id"], 11)
    regions = desk.api.get(f"/tools/{row['id']}/regions")["items"]
    assert sorted(region["name"] for region in regions) == [
        "A",
        "B",
        "C",
        "E",
        "F",
        "G",
        "H",
        "I",
        "J",
        "K",
        "L",
    ]  # the larger keeps its name

    enter(page, "Shift+P", "Click two points")  # K, the floor's last row, across its length
    click_points(page, between(pixels, 10, 9), between(pixels, 10, 11))
    page.get_by_role("button", name="Split K").click()
    wait_for_count(desk, row["id"], 12)

    enter(page, "Shift+C", "Click two points")  # H, between G and I
    click_points(page, between(pixels, 7, 6), between(pixels, 7, 8))
    page.get_by_role("button", name="Cut H").wait_for()
    page.keyboard.press("Enter")
    tool = wait_for_count(desk, row["id"], 13)
    assert tool["edit"]["undo"]

    page.reload()
    expect(page.locator("[data-key=tab-regions]")).to_have_text("13 regions")
    page.get_by_role("button", name="History").click()
    expect(page.locator(".history-list li")).to_have_count(4)
    for count in (12, 11, 12):
        page.keyboard.press("Control+z")
        wait_for_count(desk, row["id"], count)
    assert not desk.api.get(f"/tools/{row['id']}")["edit"]["can_undo"]
    page.locator(".history-list li").nth(2).get_by_role("button").click()  # any step can be gone to
    page.keyboard.press("Control+Shift+z")  # pressed while that is under way: it waits its turn
    wait_for_count(desk, row["id"], 13)
    for _ in range(3):
        page.keyboard.press("Control+z")
    desk.api.until(f"/tools/{row['id']}", lambda tool: not tool["edit"]["can_undo"])
    wait_for_count(desk, row["id"], 12)


def test_edits_by_table_and_keyboard(desk: Studio) -> None:
    """Box, grid, lock, hide, rename; a locked region refuses with a sentence beside the tools."""
    page = desk.page
    row, pixels = editing(desk, "Hood 09")
    count = row["region_count"]

    page.keyboard.press("Shift+B")
    low, high = pixels.min(axis=0) - 40, pixels.max(axis=0) + 40
    page.mouse.move(*low)
    page.mouse.down()
    page.mouse.move(*(low + high) / 2)
    page.mouse.move(*high)
    page.mouse.up()
    expect(page.locator("tr[aria-selected=true]")).to_have_count(count)

    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    expect(page.locator("tr[aria-selected=true]")).to_have_count(0)
    page.keyboard.press("a")
    expect(page.locator("tr[aria-selected=true]")).to_have_count(1)
    assert selected(page) == ["A"]
    page.keyboard.press("Shift+G")
    page.get_by_role("spinbutton", name="Number of columns").fill("2")
    page.get_by_role("spinbutton", name="Number of columns").press("Tab")
    page.get_by_role("spinbutton", name="Width of a cell in cm").fill("9")
    page.get_by_role("spinbutton", name="Width of a cell in cm").press("Tab")
    expect(page.get_by_role("button", name="Cut into cells of 9 cm")).to_be_visible()
    page.get_by_role("button", name="Fewer rows").click()  # rows and columns count again
    page.get_by_role("button", name="More rows").click()
    page.get_by_role("button", name="Cut into 2 × 2").click()
    wait_for_count(desk, row["id"], count + 3)

    page.locator("tr[data-region='1']").click()
    facts = page.locator(".region-facts")
    known = desk.api.get(f"/tools/{row['id']}/regions")["items"][1]
    expect(facts).to_contain_text(f"{known['kind']}")
    expect(facts).to_contain_text(" cm, 0 cm free; touches " if known["free_border_mm"] == 0 else " cm free; touches ")
    expect(facts).to_contain_text("°")  # the angle to a neighbour came
    page.locator("tr[data-region='0']").click(modifiers=["Shift"])
    expect(facts).to_contain_text(" cm apart")
    page.locator("tr[data-region='1']").click()
    page.keyboard.press("Shift+L")
    page.get_by_role("button", name="Unlock B", exact=True).wait_for()
    page.keyboard.press("Shift+G")
    page.get_by_role("button", name="Cut into 2 × 2").click()
    fault = page.locator(".finish .fault")
    fault.wait_for()
    assert "lock" in fault.inner_text()
    page.keyboard.press("Escape")

    page.locator("tr[data-region='2']").click()
    page.keyboard.press("Shift+H")
    page.get_by_role("button", name="Show 1 hidden region").click()
    expect(page.get_by_role("button", name="Show 1 hidden region")).to_have_count(0)

    page.keyboard.press("F2")
    expect(page.locator(".region-table input")).to_be_focused()
    page.keyboard.type("Keel")
    page.keyboard.press("Enter")
    desk.api.until(f"/tools/{row['id']}/regions", lambda regions: "Keel" in [region["name"] for region in regions["items"]])

    page.get_by_role("button", name="cm²").click()
    areas = [float(text) for text in page.locator(".region-table td:nth-child(3)").all_inner_texts()]
    assert areas == sorted(areas, reverse=True)
    with page.expect_download() as download:
        page.get_by_role("link", name="Download the regions as CSV").click()
    lines = download.value.path().read_text(encoding="utf-8").splitlines()
    assert "area_mm2" in lines[0]
    assert len(lines) == 1 + count + 3


def test_a_row_pointed_at_is_outlined_in_the_view(desk: Studio) -> None:
    """And no longer when the pointer leaves the table."""
    page = desk.page
    _, pixels = editing(desk, "Trough 06")
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    around = FloatRect(x=low[0], y=low[1], width=high[0] - low[0], height=high[1] - low[1])

    def picture() -> np.ndarray:
        return np.array(Image.open(io.BytesIO(page.screenshot(clip=around))).convert("RGB")).astype(int)

    def wait_until(outlined: bool) -> None:
        changed = 0
        for _ in range(120):
            changed = int((np.abs(picture() - before).max(axis=2) > 40).sum())
            if changed > 50 if outlined else changed < 5:
                return
            page.wait_for_timeout(250)
        raise AssertionError(f"{changed} pixels differ")

    before = picture()
    page.locator("tr[data-region='4']").hover()
    wait_until(outlined=True)
    page.locator(".region-facts").hover()
    wait_until(outlined=False)


def test_a_demonstration_on_an_older_cut_says_so(desk: Studio) -> None:
    """Where a region was split since, the page says so and offers nothing; undo brings the order back."""
    page = desk.page
    editing(desk, "Bend 01")
    page.keyboard.press("a")
    page.keyboard.press("Shift+G")
    page.get_by_role("spinbutton", name="Number of rows").wait_for()
    page.keyboard.press("Enter")
    note = page.locator(".old-demonstrations")
    expect(note).to_contain_text("older cut")
    expect(note.get_by_role("button", name="Carry over")).to_have_count(0)
    page.keyboard.press("Control+z")
    expect(note).to_be_hidden()


def test_an_order_is_carried_over_to_the_regions_of_today(desk: Studio) -> None:
    """A region divided and put together again has another number: the note offers to carry the order over, and it arrives."""
    page = desk.page
    row, _ = editing(desk, "Bend 01")

    def middles() -> list[list[float]]:
        """Where the expert goes, in order."""
        regions = desk.api.get(f"/tools/{row['id']}/regions")["items"]
        order = desk.api.get(f"/demonstrations/{desk.tool('Bend 01')['demonstration_id']}")["sequence"]
        return [regions[region]["centroid_mm"] for region in order]

    before = middles()
    for key in ("a", "Shift+G", "Enter", "Shift+M"):  # the pieces stay selected, so they are merged at once
        page.keyboard.press(key)
    note = page.locator(".old-demonstrations")
    expect(note).to_contain_text("every region still has its counterpart")
    assert not desk.tool("Bend 01")["demonstrated"]
    note.get_by_role("button", name="Carry over").click()
    expect(page.locator(".next")).to_contain_text("It has a demonstration")
    expect(note).to_be_hidden()
    after = desk.tool("Bend 01")
    assert after["demonstration_id"] != row["demonstration_id"]
    np.testing.assert_allclose(middles(), before, atol=1e-6)


def test_a_dropped_file_becomes_a_tool(desk: Studio, server: LiveServer, api_of_all: Api) -> None:
    """From the drop to regions in under a minute, few or many by the slider; what is no CAD is refused beside the list."""
    page = desk.page
    project = api_of_all.post("/projects", {"name": "Shop", "process": "Spraying"})
    page.goto(f"{server.address}/p/{project['id']}/tools")
    page.get_by_text("Bring the first part").wait_for()
    mould = sample_moulds()[0]
    part = trimesh.Trimesh(mould.mesh.vertices * 1000, mould.mesh.faces, process=False).export(file_type="stl")
    page.evaluate(DROP, [base64.b64encode(part).decode(), "mould.stl"])
    page.get_by_role("button", name="Cut it into regions").click()
    page.locator(".region-table tbody tr").first.wait_for(timeout=180_000)  # the first cut on a machine compiles its kernels
    tool = api_of_all.get(f"/projects/{project['id']}/tools")["items"][0]
    assert tool["state"] == "ready"

    shop = Studio(page, server.address, api_of_all, project)
    slider = page.get_by_role("slider", name="Number of regions")
    slider.focus()
    for more in (1, 2, 3):  # the way there is one step of the history
        slider.press("ArrowRight")
        wait_for_count(shop, tool["id"], tool["region_count"] + more)
    page.locator("[data-key=mode-undo]").click()
    wait_for_count(shop, tool["id"], tool["region_count"])
    expect(slider).to_have_value(str(tool["region_count"]))

    page.evaluate(DROP, [base64.b64encode(b"solid nothing").decode(), "broken.stl"])
    refusal = page.locator(".upload-row [role=alert]")
    refusal.wait_for()
    assert "broken.stl" in refusal.inner_text()
    page.get_by_role("button", name="Dismiss").click()
    expect(refusal).to_have_count(0)
