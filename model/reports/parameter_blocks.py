"""Parameters in a report of a fit: a picture of the intervals, and undetermined parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from model.blocks import Picture, Points, Text
from model.fitting.fitted import FittedParameter
from model.fitting.identifiability import IdentifiabilityReport
from model.machine_model.model import Model
from model.reports.figures import COLOURS, QUIET, drawn, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def interval_picture(model: Model, parameters: Sequence[FittedParameter]) -> tuple[Picture, ...]:
    """Draws intervals of parameters of the model, in expected deviations from the expected value."""
    shown = [p for p in parameters if p.value is not None and p.expected is not None and p.expected_deviation]
    if not shown:
        return ()

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, 1)[0][0]
        axes.axvspan(-1, 1, color=QUIET, alpha=0.16, lw=0)
        axes.axvline(0, color=QUIET, lw=0.8)
        for row, p in enumerate(reversed(shown)):
            assert p.expected is not None
            assert p.expected_deviation is not None
            low, value, high = (
                ((0.0 if v is None else v) - p.expected) / p.expected_deviation for v in (p.low, p.value, p.high)
            )
            first_joint = min(model.parameter(p.name).joints, default=1)
            colour = COLOURS[(first_joint - 1) % len(COLOURS)]
            axes.plot([low, high], [row, row], color=colour, lw=2.0, solid_capstyle="butt")
            axes.plot([value], [row], "o", color=colour, ms=4)
        axes.set_yticks(range(len(shown)), [p.name for p in reversed(shown)])
        axes.set_ylim(-0.7, len(shown) - 0.3)
        axes.set_xlabel("(value − expected) / expected deviation")
        axes.grid(visible=False, axis="y")

    caption = (
        "Values with 95 % intervals, relative to the expected values (band: one expected deviation). "
        "Colours are those of the joints."
    )
    return (Picture(drawn(draw, 0.6 + 0.19 * len(shown)), caption),)


def undetermined_blocks(report: IdentifiabilityReport) -> tuple[Text | Points, ...]:
    """Returns combinations that the data do not determine, and the reasons why parameters are not known."""
    weak = [p for p in report.parameters if p.verdict != "known"]
    if not weak and not report.undetermined:
        return (Text("Every parameter is determined by the traces alone, without the help of the priors."),)
    blocks: list[Text | Points] = []
    if report.undetermined:
        blocks.append(Text("These changes do not change the records beyond the noise:"))
        blocks.append(Points(tuple(c.text for c in report.undetermined)))
    if weak:
        blocks.append(Text("By parameter:"))
        blocks.append(Points(tuple(f"{p.name}: {p.reason}" for p in weak)))
    if report.correlated:
        blocks.append(Text("Correlated estimates (correlation above 0.95):"))
        blocks.append(Points(tuple(", ".join(group) for group in report.correlated)))
    return tuple(blocks)
