"""Records of an arm that is the model itself, with noise drawn and readings rounded: what a fit must get right
first."""

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from model.machine_model.model import Model, base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.imported import imported

PERIOD = 0.02
STARTS = ((3.1, 0.7, 0.0), (2.6, 1.7, -1.0), (3.6, 2.2, -0.6), (3.0, 1.2, 0.8))


def machine() -> Machine:
    """The MA2000."""
    return load_machine("ma2000")


def arm() -> Model:
    """Its model."""
    return base_model(machine())


def set_points(number: int, seconds: float) -> NDArray[np.float64]:
    """(k, 3) rad: rest, then several sines a joint about a start posture, faded in."""
    rng = np.random.default_rng([11, number])
    time = PERIOD * np.arange(round(seconds / PERIOD))
    moving = np.clip(time - 0.6, 0.0, None)
    motion = np.zeros((len(time), 3))
    for joint, size in enumerate((0.30, 0.20, 0.30)):
        for frequency in (0.15, 0.35, 0.6, 1.1):
            motion[:, joint] += (
                size / (1 + 2 * frequency) * np.sin(2 * np.pi * frequency * moving + rng.uniform(0, 6.28))
            )
        motion[:, joint] -= motion[0, joint]
    return np.asarray(STARTS[number % 4] + motion * np.clip(moving / 0.5, 0.0, 1.0)[:, None])


def trace(
    model: Model,
    number: int = 0,
    seconds: float = 6.0,
    seed: int = 0,
    gains: tuple[int, int, int] = (2, 0, 0),
    points: NDArray[np.float64] | None = None,
    noise: float = 0.3,
) -> Trace:
    """One record of `model` as the arm."""
    wanted = set_points(number, seconds) if points is None else points
    joints = model.machine.modelled_joints
    record = imported(f"imagined-{number}-{seed}", period=PERIOD, gains=dict.fromkeys(joints, gains))
    time = PERIOD * np.arange(len(wanted))
    asked = Trace(
        record, joints, time, wanted, set_point=wanted, drive=np.zeros_like(wanted), tick=np.arange(len(wanted))
    )
    drawn = noise * np.random.default_rng([seed, number]).standard_normal(wanted.shape)
    answer = simulate(model, asked, Options(noise=drawn))
    return Trace(
        record,
        joints,
        time,
        answer.reading,
        set_point=wanted,
        error=answer.error,
        drive=answer.drive,
        tick=np.arange(len(wanted)),
    )


def traces(model: Model, count: int = 2, seconds: float = 6.0, seed: int = 0) -> list[Trace]:
    """Records at different postures."""
    return [trace(model, number, seconds, seed) for number in range(count)]


def changed(given: Trace, **fields: object) -> Trace:
    """The trace with some signals replaced."""
    kept = {name: getattr(given, name) for name in Trace.__dataclass_fields__}
    return Trace(**{**kept, **fields})
