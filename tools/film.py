"""Makes the film of the demonstration: drives the page of a running service, and saves what is seen as an animated
picture.

    daq serve
    python -m tools.film http://127.0.0.1:8300 docs/images/hide.webp --effect coulomb_friction --joint 2

The film shows nothing that was not on the screen. While the diagnosis computes, its pictures follow one another faster
than they came.
"""

from __future__ import annotations

import argparse
import io
import shutil
from pathlib import Path

from PIL import Image, ImageChops
from playwright.sync_api import Page, sync_playwright

SIZE = (1120, 760)
"""px of the window."""
SHOWN = (800, 543)
"""px of the film."""
EVERY_MS = 300
"""Time between two pictures, as they are taken, and as they are shown."""
MOST = 90
"""Pictures of a film; more are thinned."""
HARDLY = 12
"""Largest difference of grey (of 255) of pictures that hardly differ."""
LAST_MS = 6000
"""How long the last picture stays."""
OPTIONS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
AFTERWARDS = 14
"""Pictures after the secret has been opened, while the gap closes."""
LONGEST_MS = 600_000


def filmed(page: Page, effect: str | None, joint: int | None) -> list[Image.Image]:
    """Plays one demonstration, and returns its pictures. Raises TimeoutError where no secret is opened."""
    pictures = [_picture(page)]
    if effect is not None:
        page.get_by_text("Choose yourself what is hidden").click()
        page.get_by_role("combobox", name="Effect").select_option(effect)
        page.get_by_role("combobox", name="Joint").select_option("" if joint is None else str(joint))
        pictures += [_picture(page)] * 3
    page.get_by_role("button", name="Hide something from me" if effect is None else "Hide this").click()
    page.get_by_text("The secret is sealed").wait_for()
    page.evaluate("document.querySelector('.head').hidden = document.querySelector('main nav').hidden = true")
    for _ in range(LONGEST_MS // EVERY_MS):
        pictures.append(_picture(page))
        if page.get_by_text("The secret is open.").is_visible():
            return pictures + [_waited(page) for _ in range(AFTERWARDS)]
        page.wait_for_timeout(EVERY_MS)
    raise TimeoutError("no secret was opened")


def write(pictures: list[Image.Image], path: Path) -> None:
    """Writes an animated WebP, thinned to MOST pictures; the end of it is kept whole."""
    begun, end = _changing(pictures[:-AFTERWARDS]), pictures[-AFTERWARDS:]
    every = -(-len(begun) // (MOST - AFTERWARDS))
    kept = [*begun[::every], *end]
    times = [EVERY_MS] * (len(kept) - 1) + [LAST_MS]
    kept[0].save(path, save_all=True, append_images=kept[1:], duration=times, loop=0, quality=55, method=6)


def _changing(pictures: list[Image.Image]) -> list[Image.Image]:
    """Returns pictures without those that hardly differ from the one before: nothing is to be seen while nothing
    happens."""
    small = [picture.convert("L").resize((80, 54)) for picture in pictures]
    kept = [pictures[0]]
    for before, now, picture in zip(small, small[1:], pictures[1:], strict=False):
        greys = enumerate(ImageChops.difference(before, now).histogram())
        if max(grey for grey, count in greys if count) > HARDLY:
            kept.append(picture)
    return kept


def _waited(page: Page) -> Image.Image:
    page.wait_for_timeout(EVERY_MS)
    return _picture(page)


def _picture(page: Page) -> Image.Image:
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB").resize(SHOWN, Image.Resampling.LANCZOS)


def main() -> None:
    """Films the page of a service on the mock."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("service", help="address of the service")
    parser.add_argument("film", type=Path, help="file to write (.webp)")
    parser.add_argument("--effect", help="what to hide (default: the mock draws)")
    parser.add_argument("--joint", type=int, help="where to hide it")
    given = parser.parse_args()
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=OPTIONS)
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]}, color_scheme="light")
        page.set_default_timeout(LONGEST_MS)
        page.goto(f"{given.service}/#/diagnosis/hide")
        page.get_by_role("button", name="Hide something from me").wait_for()
        write(filmed(page, given.effect, given.joint), given.film)
        browser.close()


if __name__ == "__main__":
    main()
