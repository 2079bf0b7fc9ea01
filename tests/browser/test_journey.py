"""What an expert does first: record a tool by clicking on the canvas, then answer a question."""

import numpy as np
import pytest

from tests.browser.canvas import Studio, sample_tool

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

ORDER = [1, 4, 7, 10, 0, 3, 6, 9, 2, 5, 8, 11]
FIRST_COLOUR = np.array([0x44, 0x33, 0x93])  # dark end of the order of work, lit from above


def test_record_by_clicks_on_the_canvas(studio: Studio) -> None:
    tool, row = sample_tool("Trough 06"), studio.tool("Trough 06")
    studio.open("record", tool=row["id"])
    studio.page.locator(".view3d iframe.shown").wait_for()
    pixels = studio.region_pixels(tool)
    studio.wait_for_regions(pixels)

    for count, region in enumerate(ORDER, start=1):
        studio.page.mouse.click(*pixels[region])
        studio.page.locator(f".seq-list li:nth-child({count})").wait_for()
    assert studio.api.get(f"/tools/{row['id']}/draft")["sequence"] == ORDER
    studio.wait_for_colour(pixels[ORDER[0]], FIRST_COLOUR)

    studio.page.keyboard.press("Control+z")
    studio.page.locator(".seq-list li").nth(len(ORDER) - 1).wait_for(state="detached")
    studio.page.keyboard.press("Control+Shift+z")
    studio.page.locator(".seq-list li").nth(len(ORDER) - 1).wait_for()

    studio.page.get_by_role("button", name="Save demonstration").click()
    studio.page.get_by_text("Already demonstrated").wait_for()
    saved = studio.api.get(f"/tools/{row['id']}/demonstrations")["items"]
    assert [d["sequence"] for d in saved] == [ORDER]
    assert saved[0]["source"] == "recorded"


def test_answer_a_question_by_key(studio: Studio) -> None:
    studio.open("teach")
    studio.page.get_by_role("button", name="Start", exact=False).first.click()
    studio.page.locator(".answers").wait_for()
    run = studio.api.get(f"/projects/{studio.project['id']}/runs")["items"][0]
    before = studio.api.get(f"/runs/{run['id']}/queries?state=open")["items"]
    assert before
    studio.page.locator(".view3d iframe.shown").first.wait_for()
    studio.page.keyboard.press("2")
    answered = studio.api.until(f"/queries/{before[0]['id']}", lambda query: query["state"] == "answered")
    assert (answered["kind"], answered["answer"]["value"]) == ("pair", "right")
