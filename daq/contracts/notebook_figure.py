"""A figure whose texts are shown as they are, and which a notebook shows whether or not pyplot was used before it."""

from __future__ import annotations

import io
import warnings
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

if TYPE_CHECKING:
    from matplotlib.backend_bases import RendererBase

AS_WRITTEN: dict[Any, Any] = {"text.parse_math": False}
"""Settings of matplotlib in which a text is never a formula: `$` in a robot's name is a dollar. They hold for texts
that are made while they are set."""


class NotebookFigure(Figure):
    """A Figure of matplotlib. Notebooks learn to show figures from pyplot's first one, and print the others as text;
    this one is not pyplot's."""

    def draw(self, renderer: RendererBase) -> None:
        """Draws it. A character that the font lacks becomes a box, without a warning: no caller can change a name."""
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from", UserWarning)
            super().draw(renderer)

    def _repr_png_(self) -> bytes:
        """What a notebook shows."""
        picture = io.BytesIO()
        self.savefig(picture, format="png")
        return picture.getvalue()
