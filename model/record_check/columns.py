"""Checks units, signs, columns and times of a record by the controller's law and by the balance of torques."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from daq.contracts.machine import NoController
from daq.contracts.trace import Trace
from model.machine_model.model import Model
from model.record_check.balance import (
    LEAST_REMOVED,
    OF_ALL,
    OUT_OF_SCALE,
    UNLIKE,
    WAYS,
    Factors,
    Motion,
    balance,
    factors,
    likelier,
    motion_of,
)
from model.record_check.finding import CHECK_COLUMNS, FindingKind, RecordFinding, number, times_of
from model.record_check.law import DEGREE, LawFit, best_fit, fits_of, formed_drive, time_matters
from model.record_check.law import Reading as ColumnReading

FACTOR_OF_UNIT = 1.2
"""Ratio within which a factor counts as that of another unit: gains and motors hardly differ by more."""
FACTOR_OF_GAIN = 3.0
"""Largest factor by which gains may be wrong; beyond it the drive or the gains are in another unit."""
OTHER_PERIOD = 0.05
"""Relative difference between sampling interval and control period that is reported."""
BEHIND = 0.25
"""Lag of a drive behind its motion, in samples, that is reported: half of one follows from how it is computed."""
LEADS = 1.5
"""Lead of a position over its set point, in samples, at which they count as exchanged: no joint moves before its set
point."""
FOLLOWS = 0.3
"""Least correlation of set point − position with the speed for a lead to be estimated."""


UNITS = {"N": {"lbf": 4.448, "kgf": 9.807}, "N·m": {"lbf·in": 0.113, "kgf·cm": 0.09807, "N·cm": 0.01}}
"""Other units of a drive, in the units that a file may state."""
THOUSANDS = {"thousandths of its unit (mA for A)": 1e-3, "thousands of its unit": 1e3}
RATIOS = (1e3, 3.0, 2.0, 1.5, 0.5)
"""Factors of wrong times that are tried: ms, and clocks or periods of another speed."""


def column_findings(trace: Trace, model: Model) -> tuple[RecordFinding, ...]:
    """Returns findings on a record's columns and times; empty if they match the machine file."""
    return tuple(_Witnesses(trace, model).findings())


@dataclass(frozen=True)
class _Witnesses:
    trace: Trace
    model: Model

    def findings(self) -> Iterator[RecordFinding]:
        machine = self.model.machine
        joints = machine.modelled_joints
        motion = motion_of(self.trace, self.model)
        laws = {joint: fits_of(self.trace, machine, joint) for joint in joints}
        known = {joint: best_fit(fits) for joint, fits in laws.items()}
        told: set[int] = set()
        for joint, fit in known.items():
            found = self._without_drive(joint, motion) or (None if fit is None else self._by_law(joint, fit, motion))
            if found is not None:
                told.add(joint)
                yield found
        holds = all(fit is not None for fit in known.values()) and not told
        time = self._on_times(holds=holds)
        if time is not None:
            yield time
        if time is None or time.consequence == "note":
            yield from self._by_balance(motion, told, holds=holds)

    # ---- drives that are missing

    def _without_drive(self, joint: int, motion: Motion | None) -> RecordFinding | None:
        """Finds a drive that is 0 throughout, although the controller or the motion needs one."""
        if self.trace.drive is None or self.trace.drive[:, self.trace.column(joint)].any():
            return None
        if self._asked_of_controller(joint) or self._needs_drive(joint, motion):
            return self._doubt("drive-zero", joint, "its drive is 0 throughout, although it is driven.", CHECK_COLUMNS)
        says = "its drive is 0 throughout: the joint is assumed to swing freely."
        return self._doubt("drive-zero", joint, says, CHECK_COLUMNS, sure=False)

    def _asked_of_controller(self, joint: int) -> bool:
        trace, column = self.trace, self.trace.column(joint)
        if isinstance(self.model.machine.controller, NoController) or trace.set_point is None:
            return False
        reading = ColumnReading(trace.position[:, column], trace.set_point[:, column])
        formed = formed_drive(trace, self.model.machine, joint, reading)
        return formed is not None and bool(np.ptp(trace.set_point[:, column])) and bool(formed.any())

    def _needs_drive(self, joint: int, motion: Motion | None) -> bool:
        """Whether the motion needs a torque that is a large part of weight and inertia; free swinging needs none."""
        found = None if motion is None else balance(self.model, motion)
        if found is None:
            return False
        place = self.model.machine.modelled_joints.index(joint)
        return bool(found.left[place] > UNLIKE**2 * found.parts[place])

    # ---- the controller's law

    def _by_law(self, joint: int, fit: LawFit, motion: Motion | None) -> RecordFinding | None:
        reading, factor = fit.reading, fit.factor
        in_degrees = reading.turned or ("positions and set points" if _near(factor, DEGREE) else "")
        if in_degrees:
            says = f"its {in_degrees} are in degrees: the controller's drive then follows from them."
            return self._doubt("position-unit", joint, says, "Convert them to rad.", value=1 / DEGREE, allowed=1.0)
        if reading.swapped or (factor < 0.0 and self._drives_motion(joint, motion)):
            says = "position and set point are exchanged: the controller would drive away from its set point."
            return self._doubt("columns-swapped", joint, says, CHECK_COLUMNS)
        if factor < 0.0:
            says = "its drive has the wrong sign: it is opposite to that of the controller's gains."
            advice = "Check the sign of the drive, and of the gains."
            return self._doubt("drive-sign", joint, says, advice, value=factor, allowed=1.0)
        return self._by_size(joint, fit)

    def _by_size(self, joint: int, fit: LawFit) -> RecordFinding | None:
        """Finds a drive of the right sign that differs in size or time from that of the gains."""
        if not 1 / FACTOR_OF_GAIN < fit.factor < FACTOR_OF_GAIN:
            return self._scale(
                joint, fit.factor, "the drive that the controller's gains give for set point and position"
            )
        late = fit.reading.late
        if late:
            way, other, seen = ("low", "up", "before") if late > 0 else ("high", "down", "after")
            rows = times_of(abs(late), "row")
            says = f"its drive is {rows} too {way} in the file: it follows from set point and position {rows} {seen}."
            advice = f"Move the drive {other} by {rows}."
            return self._doubt("drive-late", joint, says, advice, value=float(late), allowed=0.0)
        return None

    def _drives_motion(self, joint: int, motion: Motion | None) -> bool:
        """Whether the drive causes the motion as recorded. Its sign is then right, and set point and position are
        exchanged."""
        found = None if motion is None else balance(self.model, motion)
        if found is None:
            return self._leads(joint)
        place = self.model.machine.modelled_joints.index(joint)
        assert motion is not None
        turned = balance(self.model, WAYS["drive-sign"](motion, [place]))
        return turned is None or found.left[place] < turned.left[place]

    def _leads(self, joint: int) -> bool:
        """Whether the position moves before its set point."""
        trace, column = self.trace, self.trace.column(joint)
        if trace.set_point is None:
            return False
        apart = trace.set_point[:, column] - trace.position[:, column]
        speed = np.gradient(trace.position[:, column], trace.time)
        apart, speed = apart - apart.mean(), speed - speed.mean()
        size = float(np.sqrt((apart @ apart) * (speed @ speed)))
        usual = float(np.median(np.diff(trace.time)))
        lag = float(apart @ speed) / max(float(speed @ speed), 1e-300)
        return size > 0.0 and float(apart @ speed) < -FOLLOWS * size and lag < -LEADS * usual

    # ---- times

    def _on_times(self, *, holds: bool) -> RecordFinding | None:
        trace, controller = self.trace, self.model.machine.controller
        stated = None if isinstance(controller, NoController) or controller.period.assumed else controller.period.value
        period = trace.record.period or stated
        if period is None:
            return None
        usual = float(np.median(np.diff(trace.time)))
        ticks = 1.0 if trace.tick is None else float(np.median(np.diff(trace.tick)))
        expected = period * (ticks if trace.tick is not None else trace.record.every)
        ratio = usual / expected if expected > 0.0 else 1.0
        if abs(ratio - 1.0) < OTHER_PERIOD:
            return None
        says = (
            f"samples are {number(usual)} s apart, but {number(expected)} s are stated: {number(ratio)} times as long."
        )
        joints = self.model.machine.modelled_joints
        whole = trace.tick is not None or _near(ratio, 1e3) or _near(ratio, 1e-3)
        sure = whole or (holds and any(time_matters(trace, self.model.machine, j, ratio) for j in joints))
        if sure:
            advice = "Are they in ms? Times are in s." if _near(ratio, 1e3) else "Check the times: they are in s."
            return self._doubt("time-scale", None, says, advice, value=usual, allowed=expected, unit="s")
        advice = "If each sample is one control period, the times are wrong."
        return self._doubt("time-scale", None, says, advice, value=usual, allowed=expected, unit="s", sure=False)

    # ---- torques

    def _by_balance(self, motion: Motion | None, told: set[int], *, holds: bool) -> Iterator[RecordFinding]:
        joints = self.model.machine.modelled_joints
        if motion is None or told:
            return
        found = balance(self.model, motion)
        if found is not None and found.turned > 0.0:
            yield self._gravity(found.turned)
            return
        ways = [] if holds else list(WAYS)
        if not any(self.model.machine.joint(j).kind == "revolute" for j in joints) and "degrees" in ways:
            ways.remove("degrees")
        whole = likelier(self.model, motion, None, ways)
        if whole is not None:
            yield self._of_way(whole, None if len(joints) > 1 else joints[0])
            return
        alone = [way for way in ways if way not in OF_ALL]
        for place, joint in enumerate(joints):
            way = likelier(self.model, motion, place, alone) if len(joints) > 1 and alone else None
            if way is not None:
                yield self._of_way(way, joint)
                return
        if not holds:
            scales = self._other_units(motion)
            yield from scales or self._behind(motion)
        if not isinstance(self.model.machine.controller, NoController) and not holds:
            for joint in joints:
                if self._leads(joint):
                    yield self._doubt(
                        "columns-swapped", joint, "its position moves before its set point: are they exchanged?",
                        CHECK_COLUMNS,
                    )  # fmt: skip

    def _behind(self, motion: Motion) -> Iterator[RecordFinding]:
        """Finds drives that lag the motion that they cause, which no delay of an arm explains."""
        found = balance(self.model, motion)
        for place, joint in enumerate(self.model.machine.modelled_joints):
            late = 0.0 if found is None else float(found.behind[place])
            if late > BEHIND:
                says = f"its drive lags the motion that it causes by {number(late)} samples: it is too low in the file."
                rows = times_of(math.ceil(late - BEHIND), "row")
                advice = f"Move the drive up by {rows}, if all values of a row are read at the same time."
                yield self._doubt("drive-late", joint, says, advice, value=late, allowed=BEHIND, sure=False)

    def _other_units(self, motion: Motion) -> list[RecordFinding]:
        """Finds drives or times in another unit, and clocks of another speed, by the torques of the bodies.

        Friction may take nearly all of the drive. An unstated load would look like a slow clock.
        """
        joints = self.model.machine.modelled_joints
        found = factors(self.model, motion)
        known = [one for one in found if one.inertia is not None]
        named = {unit for joint in joints for unit in self.model.machine.joint(joint).drive_units}
        others = UNITS.get(next(iter(named)), {}) if len(named) == 1 else {}
        units = {**THOUSANDS, **others}
        power = 2 if motion.speed is None else 1
        ways: dict[str | float, Factors] = {unit: Factors(*[1 / size] * 4) for unit, size in units.items()}
        ways |= {ratio: Factors(None, ratio**power, 1.0, ratio ** (power - 1)) for ratio in RATIOS}
        near = {way: apart for way, made in ways.items() if (apart := _apart(known, made)) is not None}
        if not near:
            return list(self._out_of_scale(motion, found))
        value = min(near, key=lambda way: near[way])
        if isinstance(value, str):
            says = f"drive and motion agree if the drive is in {value}."
            return [self._doubt("drive-scale", None, says, "Check the unit of the drive.")]
        says = "drive and motion need another inertia than the machine file's: there is a load, or times are wrong."
        unit = ", as in ms" if value == 1e3 else ""
        advice = f"Should times be {value:.3g} times as long{unit}? They must be in s."
        # A drive that was converted once too often looks like one that moves a load, so the user is only asked.
        twice = [other for other, size in others.items() if _apart(known, Factors(*[size] * 4)) is not None]
        advice += f" Or was the drive converted as if it were in {twice[0]}?" if twice else ""
        return [self._doubt("time-scale", None, says, advice, value=value, allowed=1.0, sure=bool(unit))]

    def _out_of_scale(self, motion: Motion, found: Sequence[Factors]) -> Iterator[RecordFinding]:
        balanced = balance(self.model, motion)
        for place, joint in enumerate(self.model.machine.modelled_joints):
            factor = found[place].whole
            if balanced is not None and balanced.needed[place] > OUT_OF_SCALE**2 * balanced.given[place] > 0.0:
                factor = math.sqrt(
                    balanced.given[place] / balanced.needed[place]
                )  # friction could only increase the ratio
            if factor is not None and not 1 / OUT_OF_SCALE < factor < OUT_OF_SCALE:
                yield self._scale(joint, factor, "the torque that the recorded motion needs")

    def _of_way(self, way: str, joint: int | None) -> RecordFinding:
        kind, says, advice = _WAY_WORDS[way]
        return self._doubt(kind, joint, says, advice)

    def _gravity(self, removed: float) -> RecordFinding:
        gravity = ", ".join(f"{g:.4g}" for g in self.model.machine.gravity)
        says = (
            f"drive and motion show that gravity, stated as [{gravity}] m/s², points the other way: reversed, it "
            f"removes {removed:.0%} of the remaining torque's mean square."
        )
        advice = "Check `gravity`, the posture in which positions are 0, their direction, and the sign of the drive."
        return self._doubt("gravity-reversed", None, says, advice, value=removed, allowed=LEAST_REMOVED)

    def _scale(self, joint: int, ratio: float, of: str) -> RecordFinding:
        units = self.model.machine.joint(joint).drive_units
        stated = f" Its drive is stated in {units[0]}." if len(units) == 1 else ""
        says = f"its drive is {number(ratio)} times {of}.{stated}"
        advice = "Check the unit of the drive, that positions are in rad or m and times in s, and the columns."
        return self._doubt("drive-scale", joint, says, advice, value=ratio, allowed=1.0)

    def _doubt(
        self,
        kind: FindingKind,
        joint: int | None,
        says: str,
        advice: str,
        *,
        value: float | None = None,
        allowed: float | None = None,
        unit: str = "1",
        sure: bool = True,
    ) -> RecordFinding:
        return RecordFinding(
            kind=kind,
            consequence="doubt" if sure else "note",
            record=self.trace.called,
            joint=joint,
            value=value,
            allowed=allowed,
            unit="" if value is None else unit,
            says=says,
            advice=advice,
        )


_WAY_WORDS: dict[str, tuple[FindingKind, str, str]] = {
    "degrees": ("position-unit", "drive and motion agree if positions are in degrees.", "Convert to rad."),
    "thousandths": (
        "drive-scale",
        "drive and motion agree if the drive is in thousandths of its unit (mA for A).",
        "Check the unit of the drive.",
    ),
    "thousands": (
        "drive-scale",
        "drive and motion agree if the drive is in thousands of its unit.",
        "Check the unit of the drive.",
    ),
    "drive-sign": (
        "drive-sign",
        "drive and motion agree if the drive has the other sign.",
        "Check the sign of the drive, the direction of positions, and `gear_ratio`.",
    ),
    "milliseconds": ("time-scale", "drive and motion agree if times are in ms.", "Convert times to s."),
    "seconds": (
        "time-scale",
        "drive and motion agree if times are a thousand times as long.",
        "Were times in s read as ms?",
    ),
    "position-drive": (
        "columns-swapped",
        "drive and motion agree if position and drive are exchanged.",
        CHECK_COLUMNS,
    ),
}


def _apart(found: Sequence[Factors], expected: Factors) -> float | None:
    """Returns the distance of factors from those of another unit, as a logarithm; None if they are not near, or not
    known.

    The motor's braking is included as an upper limit: unstated friction may add to it.
    """
    pairs = [
        (value, other)
        for one in found
        for value, other in (
            (one.whole, expected.whole),
            (one.inertia, expected.inertia),
            (one.weight, expected.weight),
        )
        if value is not None and other is not None
    ]
    if not pairs or not all(_near(value, other) for value, other in pairs):
        return None
    assert expected.braking is not None
    braking = [abs(math.log(one.braking / expected.braking)) for one in found if one.braking is not None]
    return max(abs(math.log(value / other)) for value, other in pairs) + max(braking, default=0.0)


def _near(factor: float, unit: float) -> bool:
    return factor > 0.0 and 1 / FACTOR_OF_UNIT < factor / unit < FACTOR_OF_UNIT
