"""How a fit is to be done."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from daq.contracts.frozen import FrozenRecord, UserRecord

Bound = FiniteFloat | None


class Prior(FrozenRecord):
    """What is expected of a parameter before any data: Gaussian, in its unit."""

    expected: FiniteFloat
    deviation: Annotated[FiniteFloat, Field(gt=0)]


class FitOptions(UserRecord):
    """How a fit is to be done; the defaults suit traces of a known machine.

    parameters: names or patterns (`joint2.*`, `*.mass`) of what to find; None: every number with an expected deviation
        but the motor's torque constants and resistances, which fix the scale of torque.
    held: names or patterns taken out of these again.
    bounds, priors: instead of the model's own, by full name; a bound or prior of None is no bound, no prior.
    use_priors: False leaves the expected deviations out altogether (nuisances keep theirs).
    method: `nelder_mead` is the source's hill climbing: plain squared error summed over the joints, no priors.
    starts: searches from different beginnings, the model's own values and seeded draws from the priors.
    start_posture: let the arm start off the posture it was read at, by the sensor's error.
    sensor_bend: let the potentiometers bend within their stated linearity; None: where the machine states one.
    bend_terms: of the sine series of each bend, at most 8.
    friction_form: leave open how friction behaves near zero speed, where laws of friction differ.
    whiten: take out the correlation of the residual before weighing it.
    consistent_inertias: find only bodies that can exist: of every link that is a body, if any of its numbers is fitted.
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
    """Simulations with drawn noise that tell what the noise does on average; 0 for none."""
    longest_memory: Annotated[int, Field(ge=0, le=100)] = 12
    """Most samples that the whitening looks back."""
    rounds: Annotated[int, Field(ge=1, le=20)] = 6
    """Most rounds of noise, whitening and search."""
    tolerance: Annotated[FiniteFloat, Field(gt=0)] = 1e-5
    most_evaluations: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    """Most evaluations of one search; None: 60 for least squares, 400 for each parameter for Nelder and Mead."""
    loop: Literal["closed", "open"] | None = None
    """None: closed where the machine has a controller."""
    signal: Literal["position", "velocity"] | None = None
    """The signal that is compared; None: what the machine's sensors measure."""
    step: Annotated[FiniteFloat, Field(gt=0, le=0.01)] = 4e-3
    """Longest step of integration, s. Readings are right to 0.003 counts (root mean square; 0.04 with backlash)."""
