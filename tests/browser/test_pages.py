"""The pages around the 3D view, clicked as people do: projects, the order list, saved demonstrations, a stopped run, both themes."""

import re

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.browser.canvas import Studio
from tests.browser.conftest import PATIENCE_MS
from tests.conftest import Api, LiveServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

PAGES = ("tools", "record", "coverage", "teach", "policy", "robot")
FAINT_TEXT = (  # every visible text with less contrast than it needs, disabled controls and the 3D stage left out
    """() => {
  const pen = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d", { willReadFrequently: true });
  const rgba = (colour) => {
    pen.clearRect(0, 0, 1, 1);
    pen.fillStyle = colour;
    pen.fillRect(0, 0, 1, 1);
    return [...pen.getImageData(0, 0, 1, 1).data].map((part, index) => (index < 3 ? part : part / 255));
  };
  const over = (top, under) => [0, 1, 2].map((k) => top[3] * top[k] + (1 - top[3]) * under[k]);
  const ground = (node) => {
    const layers = [];
    for (let at = node; at; at = at.parentElement) {
      if (getComputedStyle(at).backgroundImage !== "none") return null;
      const colour = rgba(getComputedStyle(at).backgroundColor);
      layers.push(colour);
      if (colour[3] === 1) break;
    }
    return layers.reverse().reduce((under, top) => over(top, under), [255, 255, 255]);
  };
  const light = (colour) => {
    const linear = colour.slice(0, 3).map((part) => (part / 255 <= 0.04045 ? part / 255 / 12.92 : ((part / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
  };
  const faint = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const node = walk.currentNode.parentElement;
    if (!walk.currentNode.textContent.trim() || !node.checkVisibility({ opacityProperty: true, visibilityProperty: true })) continue;
    if (node.closest(".stage, svg, .visually-hidden, :disabled, [aria-disabled=true], .old, .ahead, .undone, option")) continue;
    const behind = ground(node);
    if (!behind) continue;
    const ink = over(rgba(getComputedStyle(node).color), behind);
    const [high, low] = [light(ink), light(behind)].sort((a, b) => b - a);
    const size = parseFloat(getComputedStyle(node).fontSize);
    const contrast = (high + 0.05) / (low + 0.05);
    if (contrast < (size >= 24 ? 3 : 4.5)) faint.push(`${walk.currentNode.textContent.trim().slice(0, 40)}: ${contrast.toFixed(2)}`);
  }
  return faint;
}"""
)


def letters(page: Page) -> list[str]:
    return page.locator(".seq-list li .letter").all_inner_texts()


def saved_row(page: Page, name: str) -> Locator:
    return page.locator(".demo-list > li").filter(has=page.get_by_text(name, exact=True))


def test_new_project_and_sample(quiet_page: Page, server: LiveServer, api_of_all: Api) -> None:
    """An empty server offers the sample; a project needs a name, and what people type stays text."""
    page = quiet_page
    page.goto(server.address)
    page.get_by_role("button", name="Open the sample project").first.click()
    page.wait_for_url("**/tools*")
    page.locator(".region-table tbody tr").first.wait_for()

    page.goto(server.address)
    page.get_by_role("button", name="New project").wait_for()
    page.keyboard.press("n")
    page.get_by_role("button", name="Create project").click()
    page.get_by_text("A project needs a name").wait_for()
    page.get_by_label("Name").fill("Hull <b>7</b>")
    page.get_by_role("button", name="Create project").click()
    page.get_by_text("Bring the first part").wait_for()
    assert page.locator("b", has_text=re.compile("^7$")).count() == 0
    assert "Hull <b>7</b>" in [project["name"] for project in api_of_all.get("/projects")["items"]]


def test_the_order_is_changed_by_drag_and_keys_then_saved_and_kept(desk: Studio) -> None:
    """Trough 06: letters, drag, Alt with arrows; saved, replayed, renamed, deleted, brought back, recorded again."""
    page, row = desk.page, desk.tool("Trough 06")
    desk.open("record", tool=row["id"])
    page.locator(".left-list button").first.wait_for()
    for count, letter in enumerate("hkegidfjabcl", start=1):
        page.keyboard.press(letter)
        expect(page.locator(".seq-list li")).to_have_count(count)
    rows = page.locator(".seq-list li")
    rows.nth(0).drag_to(rows.nth(3))
    expect(rows.nth(3).locator(".letter")).to_have_text("H")
    assert "".join(letters(page)) == "KEGHIDFJABCL"
    rows.nth(5).focus()
    page.keyboard.press("Alt+ArrowUp")
    expect(rows.nth(4).locator(".letter")).to_have_text("D")
    page.keyboard.press("Alt+ArrowUp")  # the row that was moved keeps the focus
    expect(rows.nth(3).locator(".letter")).to_have_text("D")
    assert "".join(letters(page)) == "KEGDHIFJABCL"

    page.keyboard.press("Control+s")
    page.get_by_text("Trough 06 saved").wait_for()
    page.get_by_role("button", name="Saved").click()
    saved = saved_row(page, "Trough 06")
    saved.get_by_role("button", name="Replay: Trough 06").click()
    page.get_by_role("button", name="Back to recording").wait_for()
    page.get_by_text(re.compile(r"after step [1-9]")).wait_for()
    page.keyboard.press("Escape")
    saved.hover()
    saved.get_by_role("button", name="Rename demonstration Trough 06").click()
    page.keyboard.type("Floor first")
    page.keyboard.press("Enter")
    mine = saved_row(page, "Floor first")
    mine.get_by_role("button", name="Delete: Floor first").click()
    expect(mine).to_have_count(0)
    page.get_by_role("button", name="Undo", exact=True).last.click()
    mine.wait_for()
    mine.get_by_role("button", name="Record again: Floor first").click()
    page.get_by_text("the older order stays").wait_for()
    assert [d["name"] for d in desk.api.get(f"/tools/{row['id']}/demonstrations")["items"]] == ["Floor first"]


def test_a_stopped_run_goes_on_from_its_card(desk: Studio) -> None:
    """On a sample project of its own: what other tests record there could contradict the expert's orders."""
    page = desk.page
    Studio(page, desk.address, desk.api, desk.api.post("/projects/sample")).open("teach")
    page.get_by_role("button", name="Start learning").click()
    page.locator(".answers").wait_for()
    page.locator("details.drawer summary").click()
    page.get_by_role("button", name="Stop training").click()
    page.get_by_text("The run was stopped").wait_for()
    expect(page.locator(".btn.primary")).to_have_count(1)
    page.get_by_role("button", name="Go on").click()
    page.locator(".answers").wait_for()


def test_every_page_reads_well_in_both_themes_and_lists_its_keys(desk: Studio) -> None:
    """Contrast of every text, and `?` on each page: what the list promises is printed as on the keyboard."""
    page, faint, keys = desk.page, {}, {}
    for name in PAGES:
        desk.open(name)
        page.locator(".head h1, .question h1, .empty h2").first.wait_for()
        expect(page.locator(".skeleton")).to_have_count(0)
        if page.locator(".view3d").count():
            page.locator(".view3d iframe.shown").first.wait_for()
        for theme in ("light", "dark"):
            if page.evaluate("document.documentElement.dataset.theme") != theme:
                page.get_by_role("button", name="Light or dark").click()
            page.wait_for_function(
                "() => document.getAnimations().every((a) => a.playState !== 'running' || a.effect.getTiming().iterations === Infinity)"
            )
            faint[name, theme] = page.evaluate(FAINT_TEXT)
        page.keyboard.press("?")
        keys[name] = page.locator("dialog.keys .key-row").all_inner_texts()
        page.keyboard.press("Escape")
        expect(page.locator("dialog.keys[open]")).to_have_count(0)
    assert {where: texts for where, texts in faint.items() if texts} == {}
    assert all(any("Show these keys" in row for row in rows) for rows in keys.values()), keys
    assert any("Split by plane" in row and "Shift" in row for row in keys["tools"])
    assert any("Undo" in row and "Z" in row for row in keys["record"])


def test_a_page_goes_on_after_the_server_was_restarted(chromium: Browser, server: LiveServer, api_of_all: Api, sample: dict) -> None:
    """The server is killed and started again: the open page hears of changes again, and its 3D view comes back."""
    page = chromium.new_page(viewport={"width": 1280, "height": 720}, color_scheme="light")
    page.set_default_timeout(PATIENCE_MS)
    studio = Studio(page, server.address, api_of_all, sample)
    row = studio.tool("Dish 08")
    studio.open("record", tool=row["id"])
    page.locator(".view3d iframe.shown").wait_for()
    with page.expect_request("**/api/v1/events*", timeout=PATIENCE_MS):
        server.kill()
        server.start()
    api_of_all.post(f"/tools/{row['id']}/draft/pick", {"region": 2}, status=200)
    expect(page.locator(".seq-list li")).to_have_count(1, timeout=PATIENCE_MS)
    page.keyboard.press("a")
    expect(page.locator(".seq-list li")).to_have_count(2, timeout=PATIENCE_MS)
    page.close()
