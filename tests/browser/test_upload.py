"""Bringing a part: by button, by drop, with questions about body, size and direction, and refusals in words."""

import base64
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from app.geometry.parsing import parse
from app.geometry.preview import preview
from app.viewer.file_nodes import file_camera, other_arrows
from app.viewer.projection import project
from tests.browser.canvas import Studio
from tests.geometry.cad_files import exported, glb

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

expect.set_options(timeout=180_000)  # the first part on a machine waits for kernels to be compiled

DROP = """([name, content]) => {
  const bytes = Uint8Array.from(atob(content), (c) => c.charCodeAt(0));
  const data = new DataTransfer();
  data.items.add(new File([bytes], name));
  const about = { dataTransfer: data, bubbles: true, cancelable: true };
  for (const type of ["dragenter", "dragover", "drop"]) document.body.dispatchEvent(new DragEvent(type, about));
}"""


@pytest.fixture
def tools_page(studio: Studio) -> Page:
    """The tools page of the sample project, ready for files."""
    studio.page.set_viewport_size({"width": 1500, "height": 950})
    studio.open("tools")
    studio.page.locator(".tool-list a").first.wait_for()
    return studio.page


def click_arrow(page: Page, name: str, content: bytes, wanted: str) -> None:
    """Click the arrow of a direction in the 3D view until the page has heard of it.

    Software rendering draws what the page says a moment later, so that a click may meet another arrow: then from there again.
    """
    parsed, box = parse(content, Path(name).suffix[1:]), page.locator(".view3d iframe").first.bounding_box()
    assert box is not None
    for _ in range(20):
        up = page.locator('.ask-form [name="up"]:checked').get_attribute("value") or ""
        if up == wanted:
            return
        file = preview(parsed, up)
        start, way = other_arrows(file.mesh.vertices.min(0), file.mesh.vertices.max(0), up)[wanted]
        x, y = project((start + 0.7 * way)[None], file_camera(file, up), box["width"], box["height"])[0]
        page.mouse.click(box["x"] + x, box["y"] + y)
        page.wait_for_timeout(1500)
    raise AssertionError(f"no click on the arrow of {wanted} was heard")


def choose(page: Page, name: str, content: bytes, field: str = "#cad-file") -> None:
    page.locator(field).set_input_files({"name": name, "mimeType": "application/octet-stream", "buffer": content})


def drop(page: Page, name: str, content: bytes) -> None:
    page.evaluate(DROP, [name, base64.b64encode(content).decode()])


def test_refusals_show_their_sentence_and_go_away(tools_page: Page, studio: Studio) -> None:
    """An empty file, and a damaged one beside a good one: alerts that stay until dismissed; the good one asks its questions."""
    before = len(studio.api.get(f"/projects/{studio.project['id']}/tools")["items"])
    choose(tools_page, "hollow.stl", b"")
    alert = tools_page.get_by_role("alert").filter(has_text="hollow.stl")
    expect(alert).to_contain_text("hollow.stl is empty (0 bytes). Export the part again.")
    tools_page.get_by_role("button", name="Dismiss").click()
    expect(alert).to_have_count(0)
    assert len(studio.api.get(f"/projects/{studio.project['id']}/tools")["items"]) == before

    cut, whole = b"ISO-10303-21;\nDATA;\n", exported("obj")
    files = [{"name": name, "mimeType": "", "buffer": content} for name, content in (("cut.step", cut), ("whole.obj", whole))]
    tools_page.locator("#cad-file").set_input_files(files)  # pyright: ignore[reportArgumentType]
    expect(tools_page.get_by_role("alert").filter(has_text="cut.step")).to_contain_text("is truncated")
    expect(tools_page.locator(".ask-form")).to_contain_text("How large is it?")
    assert studio.tool("whole")["state"] == "asking"


def test_a_dropped_part_asks_and_a_dropped_template_is_a_tool(tools_page: Page, studio: Studio, tmp_path: Path) -> None:
    """An STL dropped on the page: units with an unlikely one marked, direction guessed; answered, it becomes regions."""
    drop(tools_page, "bump.stl", exported("stl"))
    form = tools_page.locator(".ask-form")
    expect(form).to_contain_text("How large is it?")
    expect(form.locator('[name="units"]:checked')).to_have_value("mm")
    expect(form.locator('label:has([value="mm"])')).to_contain_text("60 × 40 × 25 mm")
    expect(form.locator('label:has([value="m"])')).to_contain_text("would be 60 m long")
    expect(form.locator('[name="up"]:checked')).to_have_value("+z")
    tools_page.screenshot(path=tmp_path / "questions.png")
    form.get_by_role("button", name="Cut it into regions").click()
    expect(tools_page.locator("tr[data-region]").first).to_be_visible()
    assert studio.tool("bump")["units"] == "mm"

    with tools_page.expect_download() as download:
        tools_page.locator('[data-key="template-json"]').click()
    assert download.value.suggested_filename == "region-table.json"
    drop(tools_page, "first.json", Path(download.value.path()).read_bytes())
    expect(tools_page.locator(".title")).to_contain_text("first.json")
    expect(tools_page.locator("tr[data-region]")).to_have_count(4)
    assert studio.tool("first")["demonstrated"]


def test_one_of_several_bodies_and_another_later(tools_page: Page, studio: Studio, tmp_path: Path) -> None:
    """A GLB with two bodies asks which; the report says what was left out; another direction is a click away."""
    content = glb((("base plate", 1.0), ("clamp", 0.5)))
    choose(tools_page, "fixture.glb", content)
    form = tools_page.locator(".ask-form")
    expect(form).to_contain_text("Which of the 2 bodies is the tool?")
    expect(form.locator(".body-list label")).to_have_count(3)
    expect(form.locator('label:has([value="2"])')).to_contain_text("clamp")
    expect(form.locator('label:has([value="2"])')).to_contain_text("30 × 20 × 12.5 mm")
    tools_page.screenshot(path=tmp_path / "bodies.png")
    view = tools_page.locator(".view3d")
    expect(view).to_have_attribute("aria-label", "3D view of the file fixture.glb with +z up")
    form.locator('[name="up"][value="+x"]').check()  # it stands as it would
    expect(view).to_have_attribute("aria-label", "3D view of the file fixture.glb with +x up")
    tools_page.screenshot(path=tmp_path / "arrows.png")
    click_arrow(tools_page, "fixture.glb", content, "-y")
    expect(view).to_have_attribute("aria-label", "3D view of the file fixture.glb with -y up")
    expect(form.locator('[name="up"][value="-y"]')).to_be_checked()
    with tools_page.expect_response(lambda answer: answer.url.endswith("/scene") and answer.json()["scene"].get("body") == "2"):
        form.locator('[name="body"][value="2"]').check()
    form.locator('[name="up"][value="+z"]').check()
    form.get_by_role("button", name="Cut it into regions").click()
    expect(tools_page.locator("tr[data-region]").first).to_be_visible()
    assert studio.tool("fixture")["body"] == "2"

    tools_page.get_by_role("button", name="History").click()
    left_out = tools_page.locator('.report-group[data-level="refused"]')
    expect(left_out).to_contain_text("Left out all bodies but clamp, one of 2 (80.0 % of the area).")
    tools_page.locator(".read-again summary").click()
    again = tools_page.locator(".read-again form")
    again.locator('[name="up"][value="-z"]').check()
    tools_page.screenshot(path=tmp_path / "again.png")
    again.get_by_role("button", name="Read it again").click()
    turned = studio.api.until(f"/tools/{studio.tool('fixture')['id']}", lambda tool: tool["state"] == "ready" and tool["up"] == "-z")
    assert turned["body"] == "2"
