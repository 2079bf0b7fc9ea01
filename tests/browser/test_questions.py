"""Questions as a file on the teach page."""

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.conftest import Api, LiveServer

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]
PARAMS = {"tolerance": 0.0001, "batch": 2, "most": 2, "samples": 16}


def test_faults_of_a_file_stay_until_they_are_dismissed(
    quiet_page: Page, server: LiveServer, api_of_all: Api, sample: dict[str, Any]
) -> None:
    page, api, project = quiet_page, api_of_all, sample["id"]
    run = api.post(f"/projects/{project}/runs", {"kind": "performance", "params": PARAMS, "seed": 1}, status=202)
    run = api.until(f"/runs/{run['id']}", lambda row: row["state"] in ("waiting_for_expert", "failed"), seconds=180)
    asked = api.get(f"/runs/{run['id']}/queries?state=open")["items"]
    page.goto(f"{server.address}/p/{project}/teach")
    page.get_by_role("button", name="Questions as a file").click()
    expect(page.get_by_role("menuitem", name="Download as a table")).to_have_attribute("href", f"/api/v1/runs/{run['id']}/questions.csv")
    page.keyboard.press("Escape")
    rows = "\n".join(["query id,answer", *(f"{q['id']},cant_tell" for q in asked), "nowhere,left"])
    page.locator("input[type=file]").set_input_files({"name": "filled.csv", "mimeType": "text/csv", "buffer": rows.encode()})
    api.until(f"/runs/{run['id']}", lambda row: row["state"] == "converged", seconds=180)
    expect(page.get_by_role("link", name="See the policy")).to_be_visible()
    expect(page.get_by_text("1 row of filled.csv does not count")).to_be_visible()
    page.get_by_role("button", name="Dismiss", exact=True).click()
    expect(page.get_by_text("1 row of filled.csv does not count")).to_have_count(0)
