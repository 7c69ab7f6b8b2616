"""A service that has studied its arm: traces, a fit, a validation and a diagnosis, each made once by the real code."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from daq.trajectories.presets import preset
from tests.server.service import Service, running_service

ARM = "mock://?pty=1&lock_step=1&seed=3&modify=coulomb_friction:joint=2,torque=8"
"""Dry friction on joint 2 that the machine file knows nothing of. In lock-step: results depend on no clock."""
RAMP = {"name": "ramp"}
SLOW_REVERSALS = preset("diagnostic-b").spec.model_dump(mode="json")
"""Here the friction stands out clearly; on one ramp of 8 s it is at the edge of what can be told."""


@dataclass(frozen=True)
class Studied:
    """Numbers of traces and jobs, and of the model that the fit made. `diagnosis` names the friction, `asking` looks on
    joint 3, finds nothing there, and asks for an experiment."""

    service: Service
    traces: tuple[str, str]
    fit: str
    validation: str
    diagnosis: str
    asking: str
    model: str

    def result(self, job: str) -> dict[str, Any]:
        """What a job found."""
        found: dict[str, Any] = self.service.robot.get(f"/jobs/{job}/result").json()["data"]
        return found


@contextmanager
def studied_arm(folder: Path) -> Iterator[Studied]:
    """Runs and computes all of it, once."""
    with running_service(folder, ARM) as service:
        service.until_connected()
        yield _studied(service)


def _studied(service: Service) -> Studied:
    first, second = _recorded(service, RAMP), _recorded(service, RAMP)
    request = {"kind": "fit", "traces": [first], "held_out": [second], "parameters": ["joint2.*"], "name": "first fit"}
    fit = done(service, request)
    validation = done(service, {"kind": "validate", "traces": [second], "model": fit["model"]})
    reversals = _recorded(service, SLOW_REVERSALS), _recorded(service, SLOW_REVERSALS)
    effects = ("coulomb_friction", "load_dependent_friction")
    diagnosis = done(service, _diagnosis_request(reversals, 2, effects) | {"name": "friction"})
    asking = done(service, _diagnosis_request((first, second), 3, ("coulomb_friction", "stribeck_friction")))
    jobs = (fit["id"], validation["id"], diagnosis["id"], asking["id"])
    return Studied(service, (first, second), *jobs, fit["model"])


def _diagnosis_request(traces: tuple[str, str], joint: int, effects: tuple[str, ...]) -> dict[str, Any]:
    """A small one: two candidates on one joint, one step."""
    return {
        "kind": "diagnose",
        "traces": [traces[0]],
        "held_out": [traces[1]],
        "joints": [joint],
        "most_steps": 1,
        "effects": list(effects),
    }


def done(service: Service, request: dict[str, Any]) -> dict[str, Any]:
    """A job that has come to its end."""
    sent = service.robot.post("/jobs", json=request)
    assert sent.status_code == 201, sent.text
    job: dict[str, Any] = sent.json()
    while job["state"] in ("queued", "running"):
        job = service.robot.get(f"/jobs/{job['id']}", params={"wait": 5}).json()
    assert (job["state"], job["reason"]) == ("done", "")
    return job


def _recorded(service: Service, spec: dict[str, Any]) -> str:
    ended = service.end_of(service.robot.post("/experiments", json={"spec": spec}).json()["id"])
    assert ended["state"] == "done", ended
    number: str = ended["trace"]
    return number
