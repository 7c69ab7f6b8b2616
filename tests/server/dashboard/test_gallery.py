"""Every component in every state, light and dark, from a phone to a large screen: as it was when it was looked at."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from PIL import ImageDraw
from playwright.sync_api import Browser, expect

from tests.server.dashboard.faults import faults_of
from tests.server.dashboard.gallery import (
    MOST,
    PICTURES,
    SCENES,
    SCHEMES,
    WIDTHS,
    build,
    decoded,
    difference,
    kept,
    opened,
    picture,
    served,
    show,
)

pytestmark = pytest.mark.browser
MOST_BYTES = 1_000_000
"""Of all pictures together."""


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The gallery, built and served."""
    folder = tmp_path_factory.mktemp("gallery")
    build(folder)
    with served(folder) as found:
        yield found


@pytest.mark.parametrize("scheme", SCHEMES)
def test_every_component_looks_as_it_did(browser: Browser, address: str, scheme: str, tmp_path: Path) -> None:
    changed = []
    with opened(browser, "dark" if scheme == "dark" else "light") as page:
        for width in WIDTHS:
            now = picture(page, address, width)
            if (found := difference(decoded(now), decoded(kept(width, scheme).read_bytes()))) > MOST:
                (tmp_path / kept(width, scheme).name).write_bytes(now)
                changed.append(f"{width} px differ by {found:.0f} (allowed: {MOST:g}): look at {tmp_path}")
    assert not changed, f"{changed}; if it is meant, `python -m tests.server.dashboard.gallery`"


def test_a_missing_word_or_another_colour_is_noticed_and_the_pictures_stay_small() -> None:
    before = decoded(kept(1280, "light").read_bytes())
    moved = before.copy()
    moved.paste(before.crop((20, 60, 80, 76)), (20, 62))
    painted = before.copy()
    ImageDraw.Draw(painted).rectangle((100, 100, 112, 112), fill=(200, 16, 46))
    assert difference(before, before) == 0
    assert difference(before, painted) > MOST
    assert difference(before, moved) > MOST
    assert sum(one.stat().st_size for one in PICTURES.iterdir()) < MOST_BYTES


def test_axe_finds_no_fault_in_any_scene_and_nothing_sticks_out(browser: Browser, address: str) -> None:
    found = []
    for scheme in SCHEMES:
        with opened(browser, scheme) as page:
            for scene in SCENES:
                show(page, address, scene, WIDTHS[0])
                beyond = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
                found += [f"{scene}, {scheme}: {beyond} px stick out"] if beyond > 0 else []
                found += [f"{scene}, {scheme}: {fault}" for fault in faults_of(page)]
    assert found == []


def test_signs_and_borders_remain_where_colours_are_forced_and_letters_are_twice_as_large(
    browser: Browser, address: str
) -> None:
    context = browser.new_context(forced_colors="active", reduced_motion="reduce")
    page = context.new_page()
    show(page, address, "parts", 640)  # half of 1280 px: as at 200 %
    expect(page.get_by_text("▲").first).to_be_visible()
    stop = page.get_by_role("button", name="STOP").first
    assert stop.evaluate("one => getComputedStyle(one).borderTopStyle") == "solid"
    assert page.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    busy = page.get_by_role("button", name="busy").first.locator(".wait")
    assert busy.evaluate("one => getComputedStyle(one).animationDuration") == "0s"
    context.close()
