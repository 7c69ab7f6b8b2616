"""A figure that a notebook shows as a picture, whether or not pyplot was used before it."""

from __future__ import annotations

import io

from matplotlib.figure import Figure


class NotebookFigure(Figure):
    """A Figure of matplotlib. Notebooks learn to show figures from pyplot's first one, and print the others as text;
    this one is not pyplot's."""

    def _repr_png_(self) -> bytes:
        """What a notebook shows."""
        picture = io.BytesIO()
        self.savefig(picture, format="png")
        return picture.getvalue()
