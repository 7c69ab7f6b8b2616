"""Result of a fit: typed, saved as JSON, with lineage back to the traces."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from daq.contracts.documents import parse_json, read_text
from daq.contracts.errors import SpecError
from daq.contracts.extras import require_extra
from daq.contracts.frozen import FrozenRecord
from firmware_protocol.invalid import first_invalid
from model.fitting.fitted import FittedParameter, JointError, doubt_of, html_of, known_of, text_of
from model.fitting.identifiability import IdentifiabilityReport
from model.fitting.options import FitOptions
from model.machine_model.model import Model
from model.machine_model.record_verdict import RecordVerdict
from model.record_check.finding import RecordFinding, doubts_headline

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

RESULT_FORMAT = 1
"""Version of the file; a reader rejects newer ones."""


class FitResult(FrozenRecord):
    """Result of a fit. `names` and `covariance` include all that was free, nuisances too."""

    format: Annotated[int, Field(ge=1)] = RESULT_FORMAT
    model: Model
    """The fitted model, its lineage naming parent and traces. Nuisances are not part of it."""
    parameters: tuple[FittedParameter, ...]
    identifiability: IdentifiabilityReport
    errors: tuple[JointError, ...]
    verdict: RecordVerdict | None = None
    """Whether the model explains the records; None in results of older versions."""
    whitened_mean_square: float
    """Mean square of the whitened residual: 1 where the noise model describes the residual."""
    names: tuple[str, ...]
    values: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    traces: tuple[str, ...]
    samples: int
    options: FitOptions
    evaluations: int
    seconds: float
    converged: bool
    message: str
    on_the_edge: tuple[str, ...] = ()
    """With consistent inertias, links with a flat or thin fitted body: the traces suggest an inconsistent one."""
    record: tuple[RecordFinding, ...] = ()
    """Findings of the check of the traces before the fit."""

    def __repr__(self) -> str:
        """Returns one line; `print` shows the parameters, too."""
        traces = f"{len(self.traces)} trace{'s' if len(self.traces) > 1 else ''}"
        ended = "" if self.converged else ", not converged"
        return (
            f"<FitResult {self.model.identity}: {known_of(self.parameters)}, {self.samples} samples of {traces}{ended}>"
        )

    def __str__(self) -> str:
        """Returns the line of `repr`, the parameters as a table, what is not determined, and the verdict."""
        return "\n".join([repr(self), text_of(self.parameters, self.identifiability), *self.said])

    def _repr_html_(self) -> str:
        """Returns the same as HTML, for a notebook."""
        return html_of(repr(self)[1:-1], self.parameters, self.identifiability, self.said)

    @property
    def said(self) -> list[str]:
        """Returns the verdict in words, and a doubt that it does not contain."""
        if self.verdict is not None and self.verdict.doubt:
            return [self.verdict.text]
        verdict = [] if self.verdict is None else [self.verdict.text]
        return [*verdict, *([f"WARNING {self.doubt}"] if self.doubt else [])]

    @property
    def doubt(self) -> str:
        """Warns, in one line, to check the traces first, or that the fitted model is much farther from them than
        before.

        Empty without such a reason.
        """
        doubt = doubts_headline(self.record)
        return f"check the record first: {doubt}" if doubt else doubt_of(self.errors)

    def parameter(self, name: str) -> FittedParameter:
        """Returns the parameter of that name. Raises SpecError if it was not fitted."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise SpecError(f"parameter {name!r}: was not fitted; fitted were {', '.join(p.name for p in self.parameters)}")

    @property
    def covariance_matrix(self) -> NDArray[np.float64]:
        """Covariance (p, p), in the order of `names`."""
        return np.array(self.covariance)

    @property
    def success(self) -> bool:
        """`converged`, as SciPy calls it."""
        return self.converged

    @property
    def nfev(self) -> int:
        """`evaluations`, as SciPy calls them."""
        return self.evaluations

    @property
    def x(self) -> NDArray[np.float64]:
        """(p,) `values` as SciPy calls them, in the order of `names`."""
        return np.array(self.values)

    def to_pandas(self) -> pd.DataFrame:
        """A table with one row a fitted parameter, indexed by its name. Raises MissingExtraError."""
        require_extra("tables", "to_pandas()", "pandas")
        import pandas as pd

        return pd.DataFrame([p.model_dump() for p in self.parameters]).set_index("name")

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws how far each parameter moved, in its expected deviations, with its 95 % interval; those without an
        expectation or an interval are left out. `ax`: None for new axes. Raises MissingExtraError."""
        from daq.contracts.notebook_figure import axes_of

        axes = axes_of(ax)
        shown = [
            p for p in self.parameters if None not in (p.value, p.low, p.high, p.expected) and p.expected_deviation
        ]
        for row, p in enumerate(shown):
            ends = [
                ((v or 0.0) - (p.expected or 0.0)) / (p.expected_deviation or 1.0) for v in (p.low, p.value, p.high)
            ]
            axes.plot([ends[0], ends[2]], [row, row], color="#555555")
            axes.plot(ends[1], row, "o", color="#555555")
        axes.axvline(0.0, lw=0.7, color="#8a8a8a")
        axes.set_yticks(range(len(shown)), [p.name for p in shown])
        axes.set_xlabel("expected deviations from the expected value")
        return axes

    def save(self, path: Path) -> None:
        """Writes the result as JSON. Raises SpecError if the file cannot be written."""
        try:
            path.write_text(self.model_dump_json(indent=1) + "\n", "utf-8")
        except OSError as error:
            raise SpecError(f"{path}: cannot be written: {error.strerror}") from error


def is_result(path: Path) -> bool:
    """Whether a file looks like a fit's result rather than a model alone; it is not validated."""
    try:
        data = parse_json(read_text(path, str(path)), str(path))
    except SpecError:
        return False
    return isinstance(data, dict) and "identifiability" in data


def load_result(path: Path) -> FitResult:
    """Loads a saved fit. Raises SpecError for a missing file, another kind of file, or a newer version."""
    data = parse_json(read_text(path, str(path)), str(path))
    version = data.get("format") if isinstance(data, dict) else None
    if isinstance(version, int) and version > RESULT_FORMAT:
        raise SpecError(f"{path}: format {version} is newer than this program supports ({RESULT_FORMAT}); update it")
    try:
        return FitResult.model_validate(data)
    except ValidationError as error:
        first = first_invalid(error)
        raise SpecError(
            f"{path}: {first.where('file')}: {first.message}; the file is not the result of a fit"
        ) from error
