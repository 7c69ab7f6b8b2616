"""A motor controller that is not the one assumed."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from random import Random

from mock_controller.board.parameters import BoardParameters
from mock_controller.modifications.parameter import Effect, effect, joint_parameter, parameter
from mock_controller.plant.parameters import PlantParameters


@effect("input_delay", "u(t) → u(t − τ)", "computing time, or a buffered output")
class InputDelay(Effect):
    """The drive reaches `joint`'s motor `delay` later than the controller has computed it.

    A delay line in steps; a part of a step is shared between the two neighbours, which keeps the volt-seconds.
    """

    joint: int = joint_parameter()
    delay: float = parameter(0.0, 0.2, unit="s", null=0.0)

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:  # noqa: ARG002  (the protocol's signature)
        steps = self.delay / step_s
        self._whole = int(steps + 1e-9)
        self._part = max(steps - self._whole, 0.0)
        self.restart()

    def restart(self) -> None:
        length = self._whole + 2
        self._line = deque([0.0] * length, maxlen=length)

    def motor_volts(self, volts: float) -> float:
        self._line.append(volts)
        earlier, later = self._line[0], self._line[1]
        return later + self._part * (earlier - later)


@effect("wrong_gain", "power → limit(f · PID)", "section 6.4: adjustable gains are not the physical ones")
class WrongGain(Effect):
    """`joint`'s controller gives `factor` times the power of its gains, before the limit of the DAC."""

    joint: int = joint_parameter()
    factor: float = parameter(0.0, 5.0, null=1.0)

    def change_board(self, parameters: BoardParameters) -> BoardParameters:
        scales = list(parameters.controller_scales)
        scales[self.joint - 1] *= self.factor
        return replace(parameters, controller_scales=tuple(scales))


@effect(
    "lost_set_points",
    "set point of the previous period, in a share of periods",
    "section 6.3: the controller does not wait",
)
class LostSetPoints(Effect):
    """In a `share` of all periods `joint`'s controller keeps its previous set point. `seed` draws the periods.

    Effects with one seed lose the same periods, as when a whole fetch is missed.
    """

    joint: int = joint_parameter()
    share: float = parameter(0.0, 0.99, null=0.0)
    seed: int = parameter(0, 2**63, default=0)

    def __post_init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        self._random = Random(f"lost set points {self.seed}")
        self._taken: int | None = None

    def set_point(self, counts: int, tick: int) -> int:  # noqa: ARG002  (the protocol's signature)
        lost = self._random.random() < self.share
        if self._taken is None or not lost:
            self._taken = counts
        return self._taken
