"""A typed, synchronous client of the service, with the service's own models (`daq.contracts.service`).

    with Client("http://127.0.0.1:8300") as client:
        robot = client.robot()
        experiment = robot.experiments.submit(ExperimentSpec())
        done = robot.experiments.wait(experiment.id)
        robot.traces.download(done.trace, Path("traces"))

Requests that change nothing, and those with an idempotency key, are repeated if the service does not answer or is busy.
Other requests are never repeated.
"""

from daq.client.client import Client
from daq.client.control import ControlLostError, HeldControl
from daq.client.errors import ServiceError, ServiceNotReachedError
from daq.client.live import LiveStream
from daq.client.robot import Robot

__all__ = [
    "Client",
    "ControlLostError",
    "HeldControl",
    "LiveStream",
    "Robot",
    "ServiceError",
    "ServiceNotReachedError",
]
