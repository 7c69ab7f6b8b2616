"""A matplotlib figure that shows texts literally, and that notebooks show even if pyplot was not used before."""

from __future__ import annotations

import io
from functools import cache
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, get_font, get_font_names
from matplotlib.text import Text

from daq.contracts.errors import SpecError

if TYPE_CHECKING:
    from matplotlib.backend_bases import RendererBase

OTHER_SCRIPTS = (
    "Noto Sans CJK SC", "Noto Sans CJK JP", "Source Han Sans SC", "WenQuanYi Micro Hei", "WenQuanYi Zen Hei",
    "Droid Sans Fallback", "Microsoft YaHei", "SimHei", "PingFang SC", "Hiragino Sans", "Yu Gothic", "Malgun Gothic",
    "Arial Unicode MS", "Noto Sans", "Noto Sans Arabic", "Noto Sans Hebrew", "Noto Sans Devanagari",
)  # fmt: skip
"""Common system fonts for characters that matplotlib's own font lacks."""


@cache
def families() -> tuple[str, ...]:
    """Returns matplotlib's own font, followed by the installed fonts of other scripts."""
    installed = set(get_font_names())
    return ("DejaVu Sans", *(name for name in OTHER_SCRIPTS if name in installed))


@cache
def _drawable() -> frozenset[int]:
    return frozenset().union(*(get_font(findfont(name)).get_charmap() for name in families()))


def drawable(text: str) -> str:
    """Replaces each character that no font has by its escape, such as `\\u6d4b`."""
    known = _drawable()
    return "".join(s if s in "\n\t" or ord(s) in known else ascii(s)[1:-1] for s in text)


AS_WRITTEN: dict[Any, Any] = {"text.parse_math": False, "font.family": list(families())}
"""matplotlib settings in which text is never a formula, so that `$` in a robot's name is a dollar. They apply to texts
created while they are active."""


class NotebookFigure(Figure):
    """A matplotlib Figure. Notebooks register a display only for pyplot's figures, and print others as text; this class
    displays itself."""

    def draw(self, renderer: RendererBase) -> None:
        """Draws the figure. Characters that no font has are replaced by escapes, so that any name can be drawn."""
        for text in self.findobj(Text):
            text.set_text(drawable(text.get_text()))
        for axis in (axis for axes in self.axes for axis in (axes.xaxis, axes.yaxis)):
            for texts in getattr(getattr(axis.get_major_formatter(), "func", None), "args", ()):
                if isinstance(texts, dict):  # labels by place, from which matplotlib creates texts while it draws
                    texts.update({place: drawable(text) for place, text in texts.items()})
        super().draw(renderer)

    def _repr_png_(self) -> bytes:
        """PNG for notebooks."""
        picture = io.BytesIO()
        self.savefig(picture, format="png")
        return picture.getvalue()


def axes_of(given: Axes | None) -> Axes:
    """The axes to draw on: those given, or the only ones of a new figure, which a notebook shows. Raises SpecError for
    anything else."""
    if given is not None and not isinstance(given, Axes):
        raise SpecError(f"plot: ax: found {given!r:.80}, must be axes of matplotlib")
    return NotebookFigure(layout="constrained").subplots() if given is None else given
