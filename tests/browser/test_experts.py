"""Two experts on the pages: a name beside the order, whose orders a run learns from, and their orders side by side."""

import re

import pytest
from playwright.sync_api import expect

from tests.browser.canvas import Studio

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]


def test_two_experts_are_kept_apart_and_compared(desk: Studio) -> None:
    page, api = desk.page, desk.api
    mine = Studio(page, desk.address, api, api.post("/projects/sample"))
    project = mine.project["id"]
    mine.open("teach")
    page.get_by_role("button", name="Start learning").wait_for()
    expect(page.get_by_text("Experts side by side")).to_have_count(0)  # one expert: nothing to choose

    tool = next(t for t in api.get(f"/projects/{project}/tools")["items"] if t["demonstrated"])
    order = api.get(f"/demonstrations/{tool['demonstration_id']}")["sequence"][::-1]
    api.call("PUT", f"/tools/{tool['id']}/draft", 200, json={"sequence": order})
    mine.open("record", tool=tool["id"])
    page.get_by_text("Already demonstrated.").wait_for()
    page.get_by_label("Your name").fill("Anna")
    page.get_by_label("Your name").press("Tab")
    page.get_by_text("Scripted expert has shown this tool. Your order is kept beside it.").wait_for()
    page.get_by_role("button", name="Save demonstration").click()
    page.get_by_text(re.compile(f"{tool['name']} saved")).wait_for()

    mine.open("teach")
    page.get_by_text(f"No weights make {tool['name']} by Anna the best order, not even alone.").wait_for()
    expect(page.get_by_label(re.compile("Scripted expert .5 orders"))).to_be_checked()
    expect(page.get_by_label(re.compile("Anna .1 order"))).not_to_be_checked()
    page.get_by_text("Anna works in the order of Scripted expert backwards").wait_for()
    pictures = page.locator(".experts-pair img")
    expect(pictures).to_have_count(2)
    page.wait_for_function("() => [...document.querySelectorAll('.experts-pair img')].every((image) => image.naturalWidth > 0)")
    page.get_by_role("button", name="Start learning").click()
    page.get_by_text("Start learning").wait_for(state="detached")
    (run,) = api.get(f"/projects/{project}/runs")["items"]
    assert run["authors"] == ["Scripted expert"]
