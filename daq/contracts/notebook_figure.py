"""A figure whose texts are shown as they are, and which a notebook shows whether or not pyplot was used before it."""

from __future__ import annotations

import io
from functools import cache
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, get_font, get_font_names
from matplotlib.text import Text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.backend_bases import RendererBase

OTHER_SCRIPTS = (
    "Noto Sans CJK SC", "Noto Sans CJK JP", "Source Han Sans SC", "WenQuanYi Micro Hei", "WenQuanYi Zen Hei",
    "Droid Sans Fallback", "Microsoft YaHei", "SimHei", "PingFang SC", "Hiragino Sans", "Yu Gothic", "Malgun Gothic",
    "Arial Unicode MS", "Noto Sans", "Noto Sans Arabic", "Noto Sans Hebrew", "Noto Sans Devanagari",
)  # fmt: skip
"""Fonts that usual systems have, for characters that matplotlib's own font lacks."""


@cache
def families() -> tuple[str, ...]:
    """matplotlib's own font, and the installed ones of other scripts behind it."""
    installed = set(get_font_names())
    return ("DejaVu Sans", *(name for name in OTHER_SCRIPTS if name in installed))


@cache
def _drawable() -> frozenset[int]:
    return frozenset().union(*(get_font(findfont(name)).get_charmap() for name in families()))


def drawable(text: str) -> str:
    """A text with each character that no font has as its printable escape, as `\\u6d4b`."""
    known = _drawable()
    return "".join(s if s in "\n\t" or ord(s) in known else ascii(s)[1:-1] for s in text)


AS_WRITTEN: dict[Any, Any] = {"text.parse_math": False, "font.family": list(families())}
"""Settings of matplotlib in which a text is never a formula: `$` in a robot's name is a dollar. They hold for texts
that are made while they are set."""


class NotebookFigure(Figure):
    """A Figure of matplotlib. Notebooks learn to show figures from pyplot's first one, and print the others as text;
    this one is not pyplot's."""

    def draw(self, renderer: RendererBase) -> None:
        """Draws it. A character that no font has is its escape: no caller can change a name."""
        for text in self.findobj(Text):
            text.set_text(drawable(text.get_text()))
        for axis in (axis for axes in self.axes for axis in (axes.xaxis, axes.yaxis)):
            for texts in getattr(getattr(axis.get_major_formatter(), "func", None), "args", ()):
                if isinstance(texts, dict):  # labels by place, of which matplotlib makes texts while it draws
                    texts.update({place: drawable(text) for place, text in texts.items()})
        super().draw(renderer)

    def _repr_png_(self) -> bytes:
        """What a notebook shows."""
        picture = io.BytesIO()
        self.savefig(picture, format="png")
        return picture.getvalue()


def axes_of(given: Axes | None) -> Axes:
    """The axes to draw on: those given, or the only ones of a new figure, which a notebook shows."""
    return NotebookFigure(layout="constrained").subplots() if given is None else given
