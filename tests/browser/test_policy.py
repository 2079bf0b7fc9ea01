"""The policy page: what the expert asks of the order, beside the proof and the what-if."""

import pytest
from playwright.sync_api import expect

from tests.browser.canvas import Studio

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

SETTLED = ("waiting_for_expert", "converged", "stalled", "infeasible", "failed")


def learn(studio: Studio) -> None:
    """A policy of the project's own orders, unless an earlier test left one; what is asked is left open."""
    api, policies = studio.api, f"/projects/{studio.project['id']}/policies"
    if api.get(policies)["items"]:
        return
    body = {"kind": "performance", "params": {"samples": 16, "most": 1}, "seed": 1}
    run = api.post(f"/projects/{studio.project['id']}/runs", body, status=202)
    while run["policy_id"] is None:
        run = api.until(f"/runs/{run['id']}", lambda row: row["state"] in SETTLED, seconds=300)
        assert run["state"] in ("waiting_for_expert", "converged"), run
        for query in api.get(f"/runs/{run['id']}/queries", params={"state": "open"})["items"]:
            api.post(f"/queries/{query['id']}/answer", {"value": "cant_tell"})


def test_a_wish_changes_the_order_and_outlives_a_reload(desk: Studio) -> None:
    """Wishes are folded so that "What if?" is in sight; the region done last is asked to be first, and is."""
    page = desk.page
    learn(desk)
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


def test_asked_about_one_tool_my_way_counts_until_it_is_dropped(desk: Studio) -> None:
    """From the policy page to the questions, back with the chosen order, and back to the policy's own."""
    page, api = desk.page, desk.api
    learn(desk)
    tool = next(t for t in api.get(f"/projects/{desk.project['id']}/tools")["items"] if not t["demonstrated"])
    desk.open("policy", tool=tool["id"])
    page.get_by_role("button", name="Ask me about this tool").click()
    expect(page.get_by_role("heading", name="Which of these two comes closer to how you would do this tool?")).to_be_visible()
    page.get_by_role("button", name="The right one is my way").click()
    page.get_by_role("link", name="See the order").click()
    expect(page.locator(".proof")).to_contain_text("Your order for this tool")
    expect(page.locator(".proof")).to_contain_text("You chose it in 1 answer.")
    (asked,) = [q for q in api.get(f"/projects/{desk.project['id']}/queries")["items"] if q["kind"] == "closer"]
    names = {row["id"]: row["name"] for row in api.get(f"/tools/{tool['id']}/regions")["items"]}
    shown = [text.split()[-1] for text in page.locator(".tile").all_inner_texts()]
    assert shown == [names[region] for region in asked["right"]["sequence"]]

    page.get_by_role("button", name="Back to the policy's order").click()
    expect(page.locator(".proof")).to_contain_text("Proved optimal")
    expect(page.get_by_role("button", name="Back to the policy's order")).to_have_count(0)


def test_what_was_learned_is_told_in_a_dialog(desk: Studio) -> None:
    """The claim, every recorded order, every other tool and every weight; a recorded order is compared by a click."""
    page, api = desk.page, desk.api
    learn(desk)
    (policy, *_) = api.get(f"/projects/{desk.project['id']}/policies")["items"]
    proof, (last, *_) = policy["certificate"], policy["certificate"]["demonstrations"][::-1]
    desk.open("policy")
    page.get_by_role("button", name="What it learned").click()
    dialog = page.get_by_role("dialog", name="What the policy has learned")
    expect(dialog.get_by_role("heading", name="Every recorded order is a cheapest one")).to_be_visible()
    for title, count in (
        ("Your recorded orders", len(proof["demonstrations"])),
        ("Tools nobody has recorded", len(proof["tools"])),
        ("What costs", len(policy["weights"])),
    ):
        section = dialog.locator("section").filter(has=page.get_by_role("heading", name=title))
        expect(section.locator("tbody tr")).to_have_count(count)
    dialog.get_by_role("button", name=last["tool_name"], exact=True).click()
    expect(dialog).to_have_count(0)
    expect(page.get_by_role("heading", name=f"The order for {last['tool_name']}")).to_be_visible()
    expect(page.locator(".whatif h3")).to_contain_text("Your recorded order")
