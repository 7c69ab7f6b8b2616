"""An arm without physics for the tests of teaching: each period it goes part of the way to its set points.

A joint whose gains are 0 goes where a hand leads it.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import DaqError
from daq.contracts.experiment import Gain
from daq.contracts.machine import load_machine
from daq.contracts.sample import SampleRow
from daq.runner.arm_control import StoppedError
from daq.teaching.arm import TeachingError
from firmware_protocol.commands import StatusFlag

MA2000 = load_machine("ma2000")
REST = np.array(MA2000.rest_posture)
PERIOD = 0.02
CALIBRATIONS = [MA2000.calibration(joint) for joint in range(1, 7)]


class LinkBrokenError(DaqError):
    """The cable was pulled."""


class StandIn:
    """All six joints; `hand` gives the angles to which limp joints are led at each tick, `every` is the number of
    periods from one sample to the next."""

    joints = (1, 2, 3, 4, 5, 6)

    def __init__(self, hand: Callable[[int], Mapping[int, float]] = lambda _: {}, every: int = 1) -> None:
        self.tick = 0
        self.every = every
        self.position = REST.copy()
        self.postures = [own.rad_to_posture(float(angle)) for own, angle in zip(CALIBRATIONS, REST, strict=True)]
        self.hand = hand
        self.gain: dict[int, Gain] = dict.fromkeys(self.joints, (2, 0, 0))
        self.log: list[str] = []
        self.frozen = False
        self.broken_from: int | None = None
        self.push: dict[int, float] = {}
        self.lateness = 0.0
        self.running = False

    def place(self, joint: int, angle: float) -> None:
        """Puts a joint (from 1) where its set point then is, as near to `angle` (rad) as a posture unit allows."""
        own = CALIBRATIONS[joint - 1]
        self.postures[joint - 1] = own.rad_to_posture(angle)
        self.position[joint - 1] = own.posture_to_rad(self.postures[joint - 1])

    @contextmanager
    def driven(self) -> Iterator[None]:
        self.running = True
        try:
            yield
        except BaseException:
            if not self.frozen:
                self._freeze()
            raise
        finally:
            self.running = False

    def next_sample(self) -> SampleRow:
        if self.broken_from is not None and self.tick >= self.broken_from:
            raise LinkBrokenError("the link is lost")
        targets = np.array([own.posture_to_rad(p) for own, p in zip(CALIBRATIONS, self.postures, strict=True)])
        for _ in range(self.every):
            self._pass_period(targets)
        counts = [round(own.rad_to_counts(float(p))) for own, p in zip(CALIBRATIONS, self.position, strict=True)]
        seen = np.array([own.counts_to_rad(c) for own, c in zip(CALIBRATIONS, counts, strict=True)])
        status = StatusFlag.FROZEN if self.frozen else 0
        return SampleRow(
            self.tick,
            self.tick * PERIOD,
            self.tick * PERIOD,
            tuple(targets.tolist()),
            tuple(seen.tolist()),
            tuple((targets - seen).tolist()),
            (0.0,) * 6,
            (0,) * 6,
            int(status),
        )

    def _pass_period(self, targets: NDArray[np.float64]) -> None:
        self.tick += 1
        led = self.hand(self.tick)
        for joint in self.joints:
            if self.gain[joint] == (0, 0, 0):
                self.position[joint - 1] = led.get(joint, self.position[joint - 1])
            else:
                self.position[joint - 1] += 0.5 * (targets[joint - 1] - self.position[joint - 1])
            self.position[joint - 1] += self.push.get(joint, 0.0)

    def set_points(self, postures: Mapping[int, int]) -> None:
        assert self.running
        for joint, posture in postures.items():
            assert 0 <= posture <= 999
            self.postures[joint - 1] = posture
        self.log.append("set points")

    def freeze_for_stop(self, cause: str) -> StoppedError:
        self._freeze()
        return StoppedError(cause)

    def freeze_for_fault(self, cause: str) -> TeachingError:
        self._freeze()
        return TeachingError(cause)

    def _freeze(self) -> None:
        self.frozen = True
        self.log.append("stop")

    def gains(self) -> Mapping[int, Gain]:
        return dict(self.gain)

    def set_gains(self, joint: int, p: int, i: int, d: int) -> None:
        self.gain[joint] = (p, i, d)
        self.log.append(f"gains {joint} {p}")

    def run_for(self, periods: int) -> Callable[[], bool]:
        """An `ended` that comes true after so many periods."""
        return lambda: self.tick >= periods
