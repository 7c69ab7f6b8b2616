"""Parameters from traces: of motion, and of recorded torques."""

from __future__ import annotations

from daq.contracts.progress import Cancel
from daq.contracts.trace import Traces, several
from ma2000.given import ModelLike, model_of
from ma2000.progress import Shown, told
from model.base_parameters import base_parameters as base
from model.base_parameters.result import BaseParameters
from model.fitting import fit as motion
from model.fitting import profile as profiles
from model.fitting.options import FitOptions
from model.fitting.profile import Profile
from model.fitting.result import FitResult
from model.inverse_dynamics import fit as torques
from model.inverse_dynamics.fit import TorqueFit


def fit(
    model: ModelLike,
    traces: Traces,
    options: FitOptions | None = None,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> FitResult:
    """The parameters with which the model best repeats the traces, and how far each can be trusted.

    The model's own loop follows the recorded set points, and its readings are compared with the recorded ones.

    Raises TraceError, SpecError for input that cannot give a result; CancelledError when asked to end.
    """
    with told(progress, "fitting") as tell:
        return motion.fit(model_of(model), several(traces), options, tell, cancel)


def fit_torques(
    model: ModelLike,
    traces: Traces,
    holdout: Traces = (),
    options: FitOptions | None = None,
    *,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> TorqueFit:
    """The parameters with which the torque that the motion needs is the recorded one. Nothing is simulated, so that a
    machine without a controller can be fitted.

    `result.held_out` is the share of torque that is left on `holdout`. Raises as `fit`.
    """
    with told(progress, "fitting torques") as tell:
        one = model_of(model)
        return torques.fit_torques(one, several(traces), several(holdout), options, progress=tell, cancel=cancel)


def base_parameters(model: ModelLike, traces: Traces = (), *, seed: int = 0) -> BaseParameters:
    """The base parameters of a model's machine: the fewest combinations of inertial and friction parameters that its
    joint torques depend on, by QR with column pivoting of the regressor at random admissible postures (Gautier 1991).

    With traces that have a recorded drive, `excitation` says which of them these tell: condition number of the columns,
    and each one's deviation. Traces that cannot be judged are no error: `no_excitation` says why.

    Args:
        seed: of the drawn postures.
    """
    return base.base_parameters(model_of(model), several(traces), seed=seed)


def profile(
    fitted: FitResult,
    traces: Traces,
    name: str,
    *,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> Profile:
    """The profile likelihood of a fitted parameter: how much worse the fit becomes when it is moved, and all others are
    fitted again. It shows what the data bound on one side alone, or not at all.

    Args:
        traces: those that were fitted to.

    Raises SpecError for a parameter that was not fitted, or other traces; CancelledError when asked to end.
    """
    with told(progress, name) as tell:
        return profiles.profile(fitted, several(traces), name, tell, cancel)
