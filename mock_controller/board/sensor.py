"""Potentiometers and the 12-bit converter: joint angles in, ADC counts out.

Each potentiometer bends by its own smooth curve, drawn from the seed, within the documented linearity. The
converter adds noise and rounds half up. A potentiometer may also fail: stick, or crackle.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from random import Random

from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import ADC_COUNTS, JointCalibration
from mock_controller.board.extension_points import ChangesReading, ChangesSensor, KnowsBoard
from mock_controller.board.parameters import BoardParameters
from mock_controller.modification import Modification, of_kind

_CELLS = 256
"""Cells of a linearity curve's table; linear interpolation between them is exact to a hundredth of a count."""


class LinearityCurve:
    """Error of one potentiometer (counts) over its range: three harmonics of random size and phase.

    The largest error is 40 % to 100 % of `limit` (counts).
    """

    def __init__(self, random: Random, limit: float) -> None:
        waves = [(k, random.uniform(0.3, 1.0) / k, random.uniform(0.0, math.tau)) for k in (1, 2, 3)]
        raw = [
            sum(size * math.sin(math.tau * k * cell / _CELLS + phase) for k, size, phase in waves)
            for cell in range(_CELLS + 1)
        ]
        scale = limit * random.uniform(0.4, 1.0) / max(map(abs, raw))
        self._table = [scale * value for value in raw] + [scale * raw[-1]]

    def at(self, counts: float) -> float:
        """Returns the error (counts) where a perfect potentiometer would show `counts`."""
        place = min(max(counts, 0.0), float(ADC_COUNTS)) * (_CELLS / ADC_COUNTS)
        cell = int(place)
        left = self._table[cell]
        return left + (place - cell) * (self._table[cell + 1] - left)


class PositionSensors:
    """The six potentiometers and their converter; noise is drawn from `seed`, joint by joint.

    The curves are drawn from `arm_seed`, by default `seed`: the same arm on another day differs only in noise.
    """

    def __init__(
        self,
        parameters: BoardParameters,
        seed: int,
        modifications: Iterable[Modification] = (),
        arm_seed: int | None = None,
    ) -> None:
        arm_seed = seed if arm_seed is None else arm_seed
        limit = parameters.linearity * ADC_COUNTS
        self._calibrations: tuple[JointCalibration, ...] = parameters.calibrations
        self._curves = [LinearityCurve(Random(f"linearity {arm_seed} {j}"), limit) for j in range(1, JOINTS + 1)]
        self._noise_source = [Random(f"noise {seed} {j}") for j in range(1, JOINTS + 1)]
        self._noise = [parameters.noise] * JOINTS
        self._usual_noise = parameters.noise
        self._stuck: dict[int, int] = {}
        self._last = [0] * JOINTS
        modifications = tuple(modifications)
        self._effects: list[ChangesSensor] = of_kind(modifications, ChangesSensor)
        self._converter_effects: list[ChangesReading] = of_kind(modifications, ChangesReading)
        for curious in of_kind(modifications, KnowsBoard):
            curious.know_board(parameters)

    def read(self, angles: Sequence[float]) -> tuple[int, ...]:
        """Returns ADC counts (0–4095) of six joint angles (rad)."""
        # Noise is always drawn, so that a momentary fault does not change later noise.
        noise = [rms * source.gauss(0.0, 1.0) for rms, source in zip(self._noise, self._noise_source, strict=True)]
        counts = [min(max(math.floor(value + 0.5), 0), ADC_COUNTS - 1) for value in self.unrounded(angles, noise)]
        for index, stuck in self._stuck.items():
            counts[index] = stuck
        self._last = counts
        return tuple(counts)

    def unrounded(self, angles: Sequence[float], noise: Sequence[float]) -> list[float]:
        """Returns the converter's readings of six joint angles (rad) without rounding, with `noise` (counts) added."""
        angles = list(angles)
        for effect in self._effects:
            angles[effect.joint - 1] = effect.sensed_angle(angles[effect.joint - 1])
        ideal = [scale.rad_to_counts(angle) for scale, angle in zip(self._calibrations, angles, strict=True)]
        counts = [
            value + curve.at(value) + extra for value, curve, extra in zip(ideal, self._curves, noise, strict=True)
        ]
        for converter in self._converter_effects:
            counts[converter.joint - 1] = converter.reading(counts[converter.joint - 1])
        return counts

    def stick(self, joint: int) -> None:
        """Holds the wiper of `joint` (from 1): the reading no longer follows the arm."""
        self._stuck[joint - 1] = self._last[joint - 1]

    def crackle(self, joint: int, noise: float) -> None:
        """Adds noise of `noise` counts rms to the reading of `joint` (from 1)."""
        self._noise[joint - 1] = noise

    def repair(self, joint: int) -> None:
        """Ends sticking and noise of `joint` (from 1)."""
        self._stuck.pop(joint - 1, None)
        self._noise[joint - 1] = self._usual_noise
