"""MA2000 DAQ for programs and notebooks: connect, run, read, simulate, fit, validate, diagnose.

    import ma2000

    with ma2000.connect("mock://?lock_step=1") as arm:
        trace = arm.run("ramp").trace
    model = ma2000.base_model(ma2000.load_machine("ma2000"))
    answer = ma2000.diagnose(model, [trace])

The public interface is `__all__` (docs/python.md) and the names of plug-ins. Everything else in the packages is
internal and may change with any version.
"""

from __future__ import annotations

from importlib import import_module
from types import FunctionType
from typing import TYPE_CHECKING, Any

from ma2000.own_packages import require_own_packages

if TYPE_CHECKING:
    from daq.client import Client as Client
    from daq.client import ServiceError as ServiceError
    from daq.client import ServiceNotReachedError as ServiceNotReachedError
    from daq.contracts.errors import DaqError as DaqError
    from daq.contracts.experiment import ExperimentSpec as ExperimentSpec
    from daq.contracts.extras import Extra
    from daq.contracts.machine import Machine as Machine
    from daq.contracts.machine import load_machine as load_machine
    from daq.contracts.service.jobs import CompareRequest as CompareRequest
    from daq.contracts.service.jobs import DiagnoseRequest as DiagnoseRequest
    from daq.contracts.service.jobs import FitRequest as FitRequest
    from daq.contracts.service.jobs import ValidateRequest as ValidateRequest
    from daq.contracts.trace import Trace as Trace
    from daq.plugins import Name
    from daq.traces.catalogue import TraceSummary as TraceSummary
    from daq.trajectories.presets import PRESETS as PRESETS
    from ma2000.arm import Arm as Arm
    from ma2000.arm import connect as connect
    from ma2000.files import list_traces as list_traces
    from ma2000.files import read_trace as read_trace
    from ma2000.files import read_traces as read_traces
    from ma2000.files import write_table as write_table
    from ma2000.files import write_trace as write_trace
    from ma2000.fitting import base_parameters as base_parameters
    from ma2000.fitting import fit as fit
    from ma2000.fitting import fit_torques as fit_torques
    from ma2000.fitting import profile as profile
    from ma2000.local_service import LocalService as LocalService
    from ma2000.machine_file import save_machine as save_machine
    from ma2000.pictures import plot as plot
    from ma2000.running import Run as Run
    from ma2000.running import RunError as RunError
    from ma2000.running import run as run
    from ma2000.studies import design as design
    from ma2000.studies import diagnose as diagnose
    from ma2000.studies import validate as validate
    from model.base_parameters.result import BaseParameters as BaseParameters
    from model.design.search import DesignedExperiments as DesignedExperiments
    from model.design.search import DesignOptions as DesignOptions
    from model.discrepancy.diagnosis import Diagnosis as Diagnosis
    from model.discrepancy.options import DiagnosisOptions as DiagnosisOptions
    from model.fitting.options import FitOptions as FitOptions
    from model.fitting.profile import Profile as Profile
    from model.fitting.result import FitResult as FitResult
    from model.inverse_dynamics.fit import TorqueFit as TorqueFit
    from model.machine_model.model import Model as Model
    from model.machine_model.model import base_model as base_model
    from model.machine_model.model_file import load_model as load_model
    from model.machine_model.model_file import save_model as save_model
    from model.simulation.simulate import Simulation as Simulation
    from model.simulation.simulate import simulate as simulate
    from model.simulation.simulate import simulate_many as simulate_many
    from model.validation.criterion import Fidelity as Fidelity

_HOME = {
    "Arm": "ma2000.arm",
    "BaseParameters": "model.base_parameters.result",
    "Client": "daq.client",
    "CompareRequest": "daq.contracts.service.jobs",
    "DaqError": "daq.contracts.errors",
    "DesignOptions": "model.design.search",
    "DesignedExperiments": "model.design.search",
    "DiagnoseRequest": "daq.contracts.service.jobs",
    "Diagnosis": "model.discrepancy.diagnosis",
    "DiagnosisOptions": "model.discrepancy.options",
    "ExperimentSpec": "daq.contracts.experiment",
    "Fidelity": "model.validation.criterion",
    "FitOptions": "model.fitting.options",
    "FitRequest": "daq.contracts.service.jobs",
    "FitResult": "model.fitting.result",
    "LocalService": "ma2000.local_service",
    "Machine": "daq.contracts.machine",
    "Model": "model.machine_model.model",
    "PRESETS": "daq.trajectories.presets",
    "Profile": "model.fitting.profile",
    "Run": "ma2000.running",
    "RunError": "ma2000.running",
    "ServiceError": "daq.client",
    "ServiceNotReachedError": "daq.client",
    "Simulation": "model.simulation.simulate",
    "TorqueFit": "model.inverse_dynamics.fit",
    "Trace": "daq.contracts.trace",
    "TraceSummary": "daq.traces.catalogue",
    "ValidateRequest": "daq.contracts.service.jobs",
    "base_model": "model.machine_model.model",
    "base_parameters": "ma2000.fitting",
    "connect": "ma2000.arm",
    "design": "ma2000.studies",
    "diagnose": "ma2000.studies",
    "fit": "ma2000.fitting",
    "fit_torques": "ma2000.fitting",
    "list_traces": "ma2000.files",
    "load_machine": "daq.contracts.machine",
    "load_model": "model.machine_model.model_file",
    "plot": "ma2000.pictures",
    "profile": "ma2000.fitting",
    "read_trace": "ma2000.files",
    "read_traces": "ma2000.files",
    "run": "ma2000.running",
    "save_machine": "ma2000.machine_file",
    "save_model": "model.machine_model.model_file",
    "simulate": "model.simulation.simulate",
    "simulate_many": "model.simulation.simulate",
    "validate": "ma2000.studies",
    "write_table": "ma2000.files",
    "write_trace": "ma2000.files",
}
"""Module of each public name. Modules are imported on first use, so that a notebook that only reads traces does not
wait for a compiler."""

_ON_A_ROBOT = {"Arm", "Run", "RunError", "connect", "plot", "run"}
_ON_A_SERVICE = {"LocalService"}
_WITH_MODELS = {
    "DesignOptions",
    "DesignedExperiments",
    "Profile",
    "Simulation",
    "TorqueFit",
    "base_parameters",
    "design",
    "diagnose",
    "fit",
    "fit_torques",
    "profile",
    "simulate",
    "simulate_many",
    "validate",
}
_NEEDED: dict[Extra, tuple[str, ...]] = {
    "robot": ("matplotlib", "mujoco", "pydantic_settings"),
    "model": ("numba",),
    "server": ("uvicorn",),
}
"""Packages whose presence shows that an extra is installed."""

require_own_packages()


def __getattr__(name: str) -> Any:
    """Imports a public name on its first use. Raises MissingExtraError for one whose extra is not installed."""
    if name == "__all__":
        return [*_homes(), "__version__"]
    if name == "__version__":
        from importlib.metadata import version  # takes longer than all else here

        return version("ma2000-daq")
    home = _HOME.get(name) or (None if name.startswith("_") else _homes().get(name))
    if home is None:
        raise AttributeError(f"module 'ma2000' has no attribute {name!r}; it has {', '.join(sorted(_homes()))}")
    from daq.contracts.extras import missing_extras_named

    with missing_extras_named(f"ma2000.{name}", _extra_of(name)):
        found: object = getattr(import_module(home), name)
        if isinstance(found, FunctionType):
            from ma2000.given import checked

            found = checked(found, name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """The public names that work with the installed extras."""
    from daq.contracts.extras import is_installed

    works = {extra: all(map(is_installed, packages)) for extra, packages in _NEEDED.items()}
    names = [*_homes(), "__version__"]
    return sorted(name for name in names if (extra := _extra_of(name)) is None or works[extra])


def _homes() -> dict[str, str]:
    """Module of each public name, including plug-ins."""
    return {**{name: added.module for name, added in _added().items()}, **_HOME}


def _added() -> dict[str, Name]:
    from daq.plugins import plugins

    return {name.name: name for plugin in plugins() for name in plugin.names}


def _extra_of(name: str) -> Extra | None:
    """The extra that a public name needs; None if a client's installation has it."""
    if name in _WITH_MODELS:
        return "model"
    if name in _ON_A_SERVICE:
        return "server"
    if name in _HOME:
        return "robot" if name in _ON_A_ROBOT else None
    return added.needs if (added := _added().get(name)) is not None else None
