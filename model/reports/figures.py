"""Figures for print and screen: one style, colours for the colour-blind, light or dark like the page."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from model.arrays import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


INK = "#222222"
QUIET = "#8a8a8a"
GRID = "#e4e4e4"
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#a07800", "#4b4b9b")
"""Colours of the joints, as in the plots of traces: those of Okabe and Ito, the yellow darkened to show on paper."""

MODEL_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
"""Colours of models in the same picture."""

WIDTH = 7.2
"""Width of a page's text, inches."""

_THEMED = {INK: "ink", QUIET: "quiet", GRID: "grid"} | {c: f"colour-{k + 1}" for k, c in enumerate(COLOURS)}

_STYLE = Path(__file__).parent / "templates" / "page.mplstyle"
_INKS: dict[Any, Any] = dict.fromkeys(("text.color", "axes.labelcolor", "xtick.color", "ytick.color"), INK)
_INKS |= {"axes.edgecolor": QUIET, "grid.color": GRID}


def drawn(draw: Callable[[Figure], None], height: float, width: float = WIDTH) -> str:
    """Returns SVG of a figure of that size (inches) that `draw` fills. Its colours are variables of the page's
    style."""
    from daq.contracts.notebook_figure import NotebookFigure

    with _style():
        figure = NotebookFigure(figsize=(width, height), layout="constrained")
        draw(figure)
        _plain_powers(figure)
        stream = io.StringIO()
        figure.savefig(stream, format="svg", metadata={"Date": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r'<svg [^>]*?viewBox="([^"]+)"[^>]*>', r'<svg viewBox="\1" role="img">', text, count=1)
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    for colour, name in _THEMED.items():
        text = text.replace(f": {colour}", f": var(--{name})")
    return text.replace("font-family", "data-font")


def saved(draw: Callable[[Figure], None], height: float, path: Path, kind: str, width: float = WIDTH) -> None:
    """Saves the same as a file of that kind (png, svg, pdf), on white. Raises OSError."""
    from daq.contracts.notebook_figure import NotebookFigure

    with _style():
        figure = NotebookFigure(figsize=(width, height), layout="constrained")
        draw(figure)
        _plain_powers(figure)
        dates = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
        figure.savefig(path, format=kind, dpi=200, facecolor="white", metadata=dates.get(kind))


def _style() -> AbstractContextManager[None]:
    import matplotlib as mpl

    from daq.contracts.notebook_figure import AS_WRITTEN

    return mpl.rc_context({**mpl.rc_params_from_file(_STYLE, use_default_template=False), **_INKS, **AS_WRITTEN})


def as_label(text: str) -> str:
    """Returns a text that a legend shows: matplotlib omits labels that begin with an underline."""
    return f"\N{NO-BREAK SPACE}{text}" if text.startswith("_") else text


def _plain_powers(figure: Figure) -> None:
    """Labels logarithmic axes with plain numbers: matplotlib would write powers as formulas."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if axis.get_scale() == "log":
                axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
                axis.set_minor_formatter(NullFormatter())


def thinned(time: Floats, *signals: Floats, most: int = 1500) -> tuple[Floats, ...]:
    """Returns about `most` samples of each signal, evenly picked: a printed page resolves no more."""
    stride = max(1, -(-len(time) // most))
    return (time[::stride], *(s[::stride] for s in signals))


def band(axes: Axes, time: Floats, signal: Floats, colour: str, most: int = 300) -> None:
    """Draws a signal as a line; a long one as the mean of `most` intervals, with a band from least to largest."""
    if len(time) <= 2 * most or not np.isfinite(signal).all():
        axes.plot(time, signal, color=colour, lw=0.8)
        return
    begins = np.linspace(0, len(time), most, endpoint=False).astype(np.int64)
    counts = np.diff([*begins, len(time)])
    middle = np.add.reduceat(time, begins) / counts
    least, largest = np.minimum.reduceat(signal, begins), np.maximum.reduceat(signal, begins)
    axes.fill_between(middle, least, largest, color=colour, alpha=0.25, lw=0)
    axes.plot(middle, np.add.reduceat(signal, begins) / counts, color=colour, lw=0.8)


def panels(figure: Figure, rows: int, columns: int, **options: Any) -> Any:
    """Returns axes (rows, columns), always as a two-dimensional array."""
    return figure.subplots(rows, columns, squeeze=False, **options)


def baseline(axes: Axes) -> None:
    """Draws the zero line."""
    axes.axhline(0.0, color=QUIET, lw=0.7, zorder=1)
