"""The reference of the API at `/api/docs`: everything that the service describes, without a network."""

from collections import Counter
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Request, expect

from tests.server.dashboard.browser import Dashboard

pytestmark = pytest.mark.browser


def test_every_operation_is_shown_and_none_that_changes_something_can_be_tried(dashboard: Dashboard) -> None:
    """Nothing is tried from a page without Stop. That the policy forbids nothing, and that no request leaves, the tab
    itself watches: see its complaints. One test, since a browser takes seconds to draw the page."""
    described = dashboard.service.client.get("/openapi.json").json()
    operations = [one for path in described["paths"].values() for one in path.values()]
    page = dashboard.open("system")
    with page.expect_popup() as opened:  # beside the page, which keeps its Stop
        page.get_by_role("link", name="API reference").click()
    expect(opened.value).to_have_url(f"{dashboard.service.url}/reference.html")
    opened.value.close()
    page.goto(f"{dashboard.service.url}/reference.html")  # in the tab that is watched
    tags = Counter(tag for one in operations for tag in one.get("tags", ["default"]))
    expect(page.locator(".opblock-tag")).to_have_count(len(tags))
    assert {heading.get_attribute("data-tag") for heading in page.locator(".opblock-tag").all()} == set(tags)
    for tag in ("robots", "queue"):
        page.locator(f'.opblock-tag[data-tag="{tag}"]').click()
    expect(page.locator(".opblock")).to_have_count(tags["robots"] + tags["queue"])

    sent: list[str] = []

    def note(request: Request) -> None:
        sent.append(f"{request.method} {urlsplit(request.url).path}")

    page.on("request", note)
    page.locator("#operations-robots-stop_robot .opblock-summary-control").click()
    expect(page.get_by_text("Freezes the arm at its measured posture")).to_be_visible()
    expect(page.get_by_role("button", name="Try it out")).to_have_count(0)
    page.locator("#operations-robots-list_robots .opblock-summary-control").click()
    page.get_by_role("button", name="Try it out").click()
    page.get_by_role("button", name="Execute").click()
    expect(page.locator(".live-responses-table .response-col_status").get_by_text("200")).to_be_visible()
    assert "GET /api/v1/robots" in sent
    assert not [one for one in sent if not one.startswith("GET ")]
