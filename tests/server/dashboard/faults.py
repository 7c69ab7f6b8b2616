"""What axe finds fault with on a page as it is now."""

from typing import Any, Literal

from playwright.sync_api import Page, expect

from tests.repository.tracked import ROOT

AXE = ROOT / "server" / "dashboard" / "node_modules" / "axe-core" / "axe.min.js"
RULES: dict[str, Any] = {
    "runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"],
    "resultTypes": ["violations"],
}
COLOURS = RULES | {"runOnly": {"type": "rule", "values": ["color-contrast", "link-in-text-block"]}}
"""For a page that RULES have been asked about in another scheme of colours."""

TALL = 2400
"""px: nothing has to be scrolled, so that no header that stays in view covers half of a button."""


def faults_of(page: Page, rules: dict[str, Any] = RULES) -> list[str]:
    """One line a fault. The page's policy lets no script in from elsewhere: axe comes through the debugger."""
    assert AXE.is_file(), "make page installs it"
    size = page.viewport_size
    assert size is not None
    page.set_viewport_size({"width": size["width"], "height": TALL})
    if page.evaluate("typeof axe") == "undefined":
        page.evaluate(AXE.read_text("utf-8"))
    found: dict[str, Any] = page.evaluate("rules => axe.run(document, rules)", rules)
    page.set_viewport_size(size)
    return [_told(one) for one in found["violations"]]


SCHEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")


def faults_in_both_schemes(page: Page) -> list[str]:
    """The same light and dark, of which the second differs in its colours alone."""
    page.emulate_media(reduced_motion="reduce")  # no colour is judged on its way to another
    found = []
    for scheme, rules in zip(SCHEMES, (RULES, COLOURS), strict=True):
        page.emulate_media(color_scheme=scheme)
        expect(page.locator("html")).to_have_attribute("data-theme", scheme)
        found += [f"{scheme}: {fault}" for fault in faults_of(page, rules)]
    return found


def _told(violation: dict[str, Any]) -> str:
    places = ", ".join(str(node["target"]) for node in violation["nodes"][:4])
    return f"{violation['id']}: {violation['help']}: {places}: {violation['nodes'][0].get('failureSummary', '')}"
