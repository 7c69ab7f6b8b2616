"""Options of a fit."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from daq.contracts.frozen import FrozenRecord, UserRecord

Bound = FiniteFloat | None


class Prior(FrozenRecord):
    """Prior of a parameter: Gaussian, in its unit."""

    expected: FiniteFloat
    deviation: Annotated[FiniteFloat, Field(gt=0)]


class FitOptions(UserRecord):
    """Options of a fit; the defaults suit traces of a known machine.

    parameters: names or patterns (`joint2.*`, `*.mass`) to fit; None: every parameter with an expected deviation except
        the motor's torque constants and resistances, which fix the scale of torque.
    held: names or patterns that are excluded from these.
    bounds, priors: replace the model's, by full name; None is no bound, no prior.
    use_priors: False ignores all expected deviations (except those of nuisances).
    method: `nelder_mead` is the source's hill climbing: plain squared error summed over the joints, no priors.
    starts: number of searches, from the model's own values and from seeded draws from the priors.
    start_posture: let the arm start at a distance from its first reading, within the sensor's error.
    sensor_bend: let the potentiometers bend within their stated linearity; None: where the machine states one.
    bend_terms: of the sine series of each bend, at most 8.
    friction_form: fit the form of friction near zero speed, where laws of friction differ.
    whiten: remove the correlation of the residual before weighting.
    consistent_inertias: allow only physically consistent bodies, for every link with fitted inertial parameters.
    """

    parameters: tuple[str, ...] | None = None
    held: tuple[str, ...] = ()
    bounds: dict[str, tuple[Bound, Bound]] = {}
    priors: dict[str, Prior | None] = {}
    use_priors: bool = True
    method: Literal["least_squares", "nelder_mead"] = "least_squares"
    robust: bool = True
    starts: Annotated[int, Field(ge=1, le=100)] = 1
    seed: Annotated[int, Field(ge=0)] = 0
    start_posture: bool = True
    sensor_bend: bool | None = None
    bend_terms: Annotated[int, Field(ge=1, le=8)] = 4
    friction_form: bool = True
    whiten: bool = True
    consistent_inertias: bool = False
    replicas: Annotated[int, Field(ge=0, le=1000)] = 16
    """Simulations with drawn noise that estimate its mean effect; 0 for none."""
    longest_memory: Annotated[int, Field(ge=0, le=100)] = 12
    """Most preceding samples that the whitening uses."""
    rounds: Annotated[int, Field(ge=1, le=20)] = 6
    """Most rounds of noise, whitening and search."""
    tolerance: Annotated[FiniteFloat, Field(gt=0)] = 1e-5
    most_evaluations: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    """Most evaluations of one search; None: 60 for least squares, 400 per parameter for Nelder–Mead."""
    loop: Literal["closed", "open"] | None = None
    """None: closed if the machine has a controller."""
    signal: Literal["position", "velocity"] | None = None
    """The signal that is compared; None: the signal that the machine's sensors measure."""
    step: Annotated[FiniteFloat, Field(gt=0, le=0.01)] = 4e-3
    """Longest integration step, s. Readings are accurate to 0.003 counts (root mean square; 0.04 with backlash)."""
