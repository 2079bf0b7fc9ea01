"""The policy page: what the expert asks of the order, beside the proof and the what-if."""

import pytest
from playwright.sync_api import expect

from tests.browser.canvas import Studio

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

SETTLED = ("waiting_for_expert", "converged", "stalled", "infeasible", "failed")


def learn(studio: Studio) -> None:
    """A policy of the project's own orders; everything asked is just as good."""
    run = studio.api.post(f"/projects/{studio.project['id']}/runs", {"kind": "performance", "mode": "paper", "seed": 11}, status=202)
    while run["policy_id"] is None:
        run = studio.api.until(f"/runs/{run['id']}", lambda row: row["state"] in SETTLED, seconds=300)
        assert run["state"] != "failed", run
        if run["state"] in ("stalled", "infeasible") and run["policy_id"] is None:
            studio.api.post(f"/runs/{run['id']}/finish", status=202)
            return
        for query in studio.api.get(f"/runs/{run['id']}/queries", params={"state": "open"})["items"]:
            studio.api.post(f"/queries/{query['id']}/answer", {"value": "similar"})


def test_a_wish_changes_the_order_and_outlives_a_reload(desk: Studio) -> None:
    """Wishes are folded so that "What if?" is in sight; the region done last is asked to be first, and is."""
    page, api = desk.page, desk.api
    learn(desk)
    api.until(f"/projects/{desk.project['id']}/policies", lambda page: page["items"])
    desk.open("policy")
    tiles, asked = page.locator(".tile"), page.locator(".wishes summary")
    expect(asked).to_contain_text("nothing yet")
    expect(page.locator(".whatif p")).to_be_in_viewport(ratio=1)
    last = tiles.last.inner_text().split()[-1]

    asked.click()
    page.get_by_label("What you want").select_option("first")
    page.get_by_label("Region", exact=True).select_option(label=last)
    page.get_by_role("button", name="Add", exact=True).click()
    expect(tiles.first).to_contain_text(last)
    expect(asked).to_contain_text("1 wish")

    page.reload()
    expect(tiles.first).to_contain_text(last)
    expect(asked).to_contain_text("1 wish")
    asked.click()
    page.get_by_role("button", name=f"Take away: {last} first").click()
    expect(tiles.first).not_to_contain_text(last)
