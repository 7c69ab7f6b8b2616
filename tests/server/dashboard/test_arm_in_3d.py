"""The arm in 3-D, in a Chromium that draws it, if need be without a graphics card."""

from io import BytesIO

import pytest
from PIL import Image
from playwright.sync_api import Playwright, expect

from tests.server.dashboard.browser import WIDE, WITH_3D, MockControl, chromium, watched
from tests.server.service import Service

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def test_the_arm_is_drawn_and_moves_when_it_is_turned(driver: Playwright, served: tuple[Service, MockControl]) -> None:
    with chromium(driver, *WITH_3D) as browser:
        context = browser.new_context(viewport=WIDE)
        tab = watched(context, *served)
        page = tab.until_live()
        canvas = page.get_by_label("The arm now, in 3-D")
        expect(canvas).to_be_visible()
        expect(canvas).to_have_css("opacity", "1")  # what is not live is paler
        before = Image.open(BytesIO(canvas.screenshot())).convert("RGB")
        colours = before.getcolors(1 << 20)
        assert colours is not None
        assert len(colours) > 100
        page.get_by_role("button", name="Top", exact=True).click()
        after = Image.open(BytesIO(canvas.screenshot())).convert("RGB")
        assert before.tobytes() != after.tobytes()
        assert tab.complaints == []
        context.close()
