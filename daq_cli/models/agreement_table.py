"""The agreement of models with measurements, as a table on standard output."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from daq_cli.app.context import print_table
from model.units import shown_unit, with_unit

if TYPE_CHECKING:
    from model.comparison.agreement import JointAgreement, ModelAgreement


def print_agreement(models: Sequence[ModelAgreement]) -> None:
    """Root mean square and largest residual by model, kind of trace and joint, beside the noise floor."""
    from rich.table import Table

    table = Table(box=None, header_style="bold", title_justify="left")
    for name in ("model", "traces"):
        table.add_column(name)
    for name in ("joint", "rms", "in counts", "largest", "noise"):
        table.add_column(name, justify="right")
    for model in models:
        fitted = any(t.held_out is not None for t in model.traces)
        for kind, joints in (("in sample", model.in_sample), ("held out", model.held_out)):
            for one in joints or ():
                table.add_row(model.label, kind if fitted else "all", *_figures(one))
    print_table(table)


def agreement_data(models: Sequence[ModelAgreement]) -> list[dict[str, Any]]:
    """The same as data, with the errors in counts."""
    return [model.model_dump(mode="json") for model in models]


def _figures(one: JointAgreement) -> tuple[str, ...]:
    factor, unit = shown_unit(one.unit)
    rmse, largest, least = (with_unit(f"{v * factor:.4f}", unit) for v in (one.rmse, one.largest, one.floor))
    counts = "–" if one.counts is None else f"{one.counts:.2f}"
    return str(one.joint), rmse, counts, largest, least
