"""Estimates parameters from traces: by simulated motion, and by recorded torques."""

from __future__ import annotations

from daq.contracts.progress import Cancel
from daq.contracts.trace import Traces, as_sequence
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
    """Estimates the parameters with which the model best reproduces the traces, and how reliable each one is.

    The model's control loop follows the recorded set points; simulated readings are compared with recorded ones.

    Raises TraceError, SpecError for unusable input; CancelledError if cancelled.
    """
    with told(progress, "fitting") as tell:
        return motion.fit(model_of(model), as_sequence(traces), options, tell, cancel)


def fit_torques(
    model: ModelLike,
    traces: Traces,
    holdout: Traces = (),
    options: FitOptions | None = None,
    *,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> TorqueFit:
    """Estimates the parameters with which the torque needed for the motion equals the recorded torque. Nothing is
    simulated, so a machine without a controller can be fitted.

    `result.held_out`: share of the torque on `holdout` that remains unexplained. Raises as `fit`.
    """
    with told(progress, "fitting torques") as tell:
        one = model_of(model)
        return torques.fit_torques(
            one, as_sequence(traces), as_sequence(holdout), options, progress=tell, cancel=cancel
        )


def base_parameters(model: ModelLike, traces: Traces = (), *, seed: int = 0) -> BaseParameters:
    """Returns the base parameters of a model's machine: the fewest combinations of inertial and friction parameters on
    which its joint torques depend. Method: QR with column pivoting of the regressor at random admissible postures
    (Gautier 1991).

    With traces that have a recorded drive, `excitation` states how well they determine each: condition number of the
    columns, and deviation of each parameter. Unusable traces are no error: `no_excitation` gives the reason.

    Args:
        seed: seed of the random postures.
    """
    return base.base_parameters(model_of(model), as_sequence(traces), seed=seed)


def profile(
    fitted: FitResult,
    traces: Traces,
    name: str,
    *,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> Profile:
    """Computes the profile likelihood of a fitted parameter: how much worse the fit becomes if the parameter is moved
    and all others are fitted again. It shows if the data bound the parameter on one side only, or not at all.

    Args:
        traces: the traces of the fit.

    Raises SpecError for a parameter that was not fitted, or other traces; CancelledError if cancelled.
    """
    with told(progress, name) as tell:
        return profiles.profile(fitted, as_sequence(traces), name, tell, cancel)
