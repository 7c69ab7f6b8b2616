"""α(t): which parameter would have to vary for the model to explain a trace, how much, and with what it varies."""

from __future__ import annotations

import numpy as np

from daq.contracts.trace import Trace
from model import layout as at
from model.discrepancy.diagnosis import AgainstWhat, MovingParameter
from model.machine_model.model import Model
from model.validation.names import names_to_validate
from model.validation.time_domain import vary_in_time
from model.validation.variation import Variation

SHOWN = 5
"""Most parameters that are reported, those that explain most of the residual."""
LEAST_EXPLAINED = 0.02
"""Least share of the residual's energy that a reported parameter's variation explains."""
BY_CHANCE = 0.1
"""Twice the share of the time for which noise alone takes α(t) beyond two of its deviations."""
TERMS: dict[str, AgainstWhat] = {
    "position": "position",
    "speed": "speed",
    "magnitude of speed": "speed",
    "direction": "direction",
    "load": "position",
    "drive": "drive",
    "time": "time",
}
"""The time-domain form's names of quantities, and the answer's; the load by gravity depends on the position."""


def moving_parameters(model: Model, trace: Trace) -> tuple[MovingParameter, ...]:
    """The parameters whose variation with time explains most, by the distortion method's time-domain form.

    Empty for a trace without recorded drive, and for a model with a flexible transmission, which that form lacks.
    """
    if trace.drive is None or (model.flags & at.HAS_FLEXIBILITY).any():
        return ()
    names = [n for n in names_to_validate(model) if model.parameter(n).deviation]
    found = vary_in_time(model, trace, names)
    telling = [v for v in found.parameters if v.alone_varying > LEAST_EXPLAINED and v.significant > BY_CHANCE]
    return tuple(_moving(v) for v in sorted(telling, key=lambda v: -v.alone_varying)[:SHOWN])


def _moving(v: Variation) -> MovingParameter:
    """A variation for the answer: its range is that between the 5th and the 95th percentile of a Gaussian, without
    noise, relative to the parameter's value."""
    size = abs(v.value) if v.value != 0.0 else v.expected
    strongest = next((c for c in v.against if c.significant and c.regressor in TERMS), None)
    return MovingParameter(
        parameter=v.name,
        relative_range=2 * 1.645 * v.deviation / size,
        moves_with=None if strongest is None else TERMS[strongest.regressor],
        correlation=0.0 if strongest is None else float(np.clip(strongest.value, -1.0, 1.0)),
    )
