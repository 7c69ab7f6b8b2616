"""Chapter 8: partitioned control with each model of the ladder, and classical PID, on the plant of table 7.9."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from daq.contracts.frozen import FrozenRecord
from daq.contracts.progress import Cancel, Never, Progress, silent, stop_if
from extras.thesis.check import Check, Choice
from extras.thesis.closed_loop import ClassicalPid, ControlledMotion, Partitioned, Sinusoid, control
from extras.thesis.driven_arm import DrivenArm
from extras.thesis.tables import BASIC_WITH_BACK_EMF, VISCOUS, VISCOUS_AND_COULOMB, PublishedModel
from model.arrays import Floats

START = (math.pi, math.pi / 4, 0.0)
"""Start posture, rad: 180°, 45°, 0° (section 8.2.1)."""
OTHER_START = (math.pi, math.pi / 2, 0.0)
"""Start posture with joint 2 at 90°, rad (section 8.3)."""
AMPLITUDE = math.radians(60)
PERIOD = 3.0
PHASE = (0.0, -math.pi / 2, 0.0)
"""Phases of the joints' sinusoids, rad. Joint 2's is not given; with this one it starts at its lower end, in range."""
DURATION = 9.0
"""Length of a run, s: three periods; the source does not give it."""

BackEmf = Literal["tabled", "plant"]
Triple = tuple[float, float, float]


class ControlCase(FrozenRecord):
    """One run. Angles in rad, one series per joint.

    `back_emf`: whether the law compensates the back-EMF with its own table's constants or with the plant's.
    `amplitude_ratio`: amplitude of the position over that of the wanted motion in the first period and in the last.
    `rms`: root mean square error over the run (rad). `overshoot`: distance of the position beyond the wanted one on the
    other side of an initial error, or beyond the wanted sinusoid's ends (rad).
    """

    name: str
    law: Literal["partitioned", "pid"]
    table: str | None
    back_emf: BackEmf | None
    start: Triple
    first_amplitude_ratio: Triple
    amplitude_ratio: Triple
    rms: Triple
    overshoot: Triple
    time: tuple[float, ...]
    wanted: tuple[tuple[float, ...], ...]
    position: tuple[tuple[float, ...], ...]
    volts: tuple[tuple[float, ...], ...]


class ControlChapter(FrozenRecord):
    """Chapter 8's runs, the source's statements on them, and our choices."""

    cases: tuple[ControlCase, ...]
    checks: tuple[Check, ...]
    choices: tuple[Choice, ...]
    findings: tuple[str, ...]

    def case(self, name: str) -> ControlCase:
        """Returns the run of that name. Raises KeyError."""
        return {c.name: c for c in self.cases}[name]


@dataclass(frozen=True)
class _Run:
    name: str
    law: Partitioned | ClassicalPid
    table: str | None = None
    back_emf: BackEmf | None = None
    start: Triple = START


def control_chapter(progress: Progress = silent, cancel: Cancel | None = None) -> ControlChapter:
    """Runs all of chapter 8. Raises CancelledError when cancelled."""
    cancel = cancel or Never()
    plant = VISCOUS_AND_COULOMB.arm()
    wanted = wanted_motion()
    runs = _runs(plant)
    cases = []
    for k, run in enumerate(runs):
        stop_if(cancel)
        progress(k / len(runs), f"chapter 8: {run.name}")
        cases.append(_case(run, control(plant, run.law, wanted, run.start, DURATION, every=100), wanted))
    progress(1.0, "chapter 8: done")
    return ControlChapter(
        cases=tuple(cases), checks=_checks({c.name: c for c in cases}), choices=CHOICES, findings=FINDINGS
    )


def wanted_motion() -> Sinusoid:
    """Returns the sinusoids of section 8.2.1, through the start posture at time zero."""
    centre = tuple(s - AMPLITUDE * math.sin(p) for s, p in zip(START, PHASE, strict=True))
    return Sinusoid((centre[0], centre[1], centre[2]), (AMPLITUDE, AMPLITUDE, AMPLITUDE), PERIOD, PHASE)


def _runs(plant: DrivenArm) -> tuple[_Run, ...]:
    models: tuple[tuple[str, PublishedModel], ...] = (
        ("case 1: basic", BASIC_WITH_BACK_EMF),
        ("case 2: viscous", VISCOUS),
        ("case 3: complete", VISCOUS_AND_COULOMB),
    )
    partitioned = []
    for name, model in models:
        own = model.arm()
        partitioned.append(
            _Run(
                f"{name}, back-EMF of the plant",
                Partitioned(replace(own, back_emf=plant.back_emf)),
                model.table,
                "plant",
            )
        )
        partitioned.append(_Run(f"{name}, back-EMF as tabled", Partitioned(own), model.table, "tabled"))
    return (*partitioned, _Run("PID", ClassicalPid()), _Run("PID from 90°", ClassicalPid(), start=OTHER_START))


def _case(run: _Run, motion: ControlledMotion, wanted: Sinusoid) -> ControlCase:
    first, last = motion.time <= PERIOD, motion.time >= motion.time[-1] - PERIOD
    swing = [_triple(np.ptp(motion.position[w], axis=0) / np.ptp(motion.wanted[w], axis=0)) for w in (first, last)]
    error = motion.wanted - motion.position
    return ControlCase(
        name=run.name,
        law="partitioned" if isinstance(run.law, Partitioned) else "pid",
        table=run.table,
        back_emf=run.back_emf,
        start=run.start,
        first_amplitude_ratio=swing[0],
        amplitude_ratio=swing[1],
        rms=_triple(np.sqrt((error**2).mean(axis=0))),
        overshoot=_overshoot(motion, wanted),
        time=tuple(map(float, motion.time)),
        wanted=_columns(motion.wanted),
        position=_columns(motion.position),
        volts=_columns(motion.volts),
    )


def _overshoot(motion: ControlledMotion, wanted: Sinusoid) -> Triple:
    error = motion.wanted - motion.position
    result = []
    for j in range(3):
        if abs(error[0, j]) > math.radians(1):
            result.append(float(max(0.0, (-np.sign(error[0, j]) * error[:, j]).max())))
        else:
            beyond = np.abs(motion.position[:, j] - wanted.centre[j]) - wanted.amplitude[j]
            result.append(float(max(0.0, beyond.max())))
    return result[0], result[1], result[2]


def lags(case: ControlCase) -> Triple:
    """Returns the lag of the position behind the wanted sinusoid in the last period (rad of its phase), by joint."""
    time = np.array(case.time)
    last = time > time[-1] - PERIOD
    turning = np.exp(-2j * math.pi * time[last] / PERIOD)
    wanted, position = (np.array(columns)[:, last] @ turning for columns in (case.wanted, case.position))
    return _triple(np.angle(wanted / position))


def _checks(cases: dict[str, ControlCase]) -> tuple[Check, ...]:
    one, two, three = (
        cases[f"{n}, back-EMF of the plant"] for n in ("case 1: basic", "case 2: viscous", "case 3: complete")
    )
    tabled = [cases[f"{n}, back-EMF as tabled"] for n in ("case 1: basic", "case 2: viscous")]
    pid, other = cases["PID"], cases["PID from 90°"]
    return (
        Check(
            name="case 1: every amplitude is clearly reduced",
            holds=max(one.first_amplitude_ratio) < 0.85,
            ours=_ratios(one),
            published="significant reductions on all joints (figure 8.3)",
        ),
        Check(
            name="case 2: every joint is better than in case 1",
            holds=_all_less(two.rms, one.rms),
            ours=f"{_ratios(two)}; rms {_rms(one)} → {_rms(two)}",
            published="noticeably better, amplitude enlarged (figure 8.4)",
        ),
        Check(
            name="case 3: good agreement",
            holds=_all_less(three.rms, two.rms) and max(abs(r - 1) for r in three.amplitude_ratio) < 0.05,
            ours=f"{_ratios(three)}; rms {_rms(three)}",
            published="good agreement (figure 8.5)",
        ),
        Check(
            name="with the tabled back-EMF constants cases 1 and 2 are damped",
            holds=all(max(c.amplitude_ratio) < 1 for c in tabled),
            ours="; ".join(_ratios(c) for c in tabled),
            published="reduced amplitudes on all joints",
        ),
        Check(
            name="PID follows with a lag",
            holds=min(pid.amplitude_ratio) > 0.9 and min(lags(pid)) > 0,
            ours=f"{_ratios(pid)}; rms {_rms(pid)}; lag {'/'.join(f'{math.degrees(v):.1f}' for v in lags(pid))}°",
            published="follows nicely, with a phase lag (figure 8.6)",
        ),
        Check(
            name="PID from 90°: joint 2 overshoots",
            holds=math.degrees(other.overshoot[1]) > 2,
            ours=f"{math.degrees(other.overshoot[1]):.1f}°",
            published="considerable overshoot (figure 8.7)",
        ),
        Check(
            name="PID from 90°: joint 3 overshoots",
            holds=math.degrees(other.overshoot[2]) > 2,
            ours=f"{math.degrees(other.overshoot[2]):.1f}°",
            published="considerable overshoot (figure 8.7)",
        ),
    )


CHOICES = (
    Choice(
        what="phase of joint 2",
        value="−90°: up from 45° to 165°",
        why="only said to differ; +90° would leave the joint's range",
    ),
    Choice(what="start", value="at rest, on the wanted posture", why="the posture is given, the speeds are not"),
    Choice(what="duration", value=f"{DURATION:g} s", why="not given"),
    Choice(
        what="gain between PID and motor", value="28", why="(8.5) and (8.7) put the voltage at the amplifier's input"
    ),
    Choice(
        what="amplifier",
        value="linear, without limit, in continuous time",
        why="as figure 8.2 has it; the PID asks for "
        "hundreds of volts when it starts off its path, and sampled at 20 ms it is unstable",
    ),
    Choice(
        what="sign of Coulomb friction", value="linear within 0.01 rad/s", why="(7.32) to (7.34) print no sign of speed"
    ),
    Choice(
        what="inertia of link 3 with its load", value="(7.28) in plant and law", why="what the tables were made with"
    ),
)

FINDINGS = (
    (
        "Table 7.5 has K_b1-3 = 0.0378 and K_b2 = 0.0747, the plant (table 7.9) 0.0334 and 0.0369. A law that "
        "compensates back-EMF with the former feeds back more than there is: joint 1 (and joint 2) swing further "
        "than wanted, not less. With the plant's back-EMF in all three laws the runs come out as described. The "
        "source must have done that, or something that amounts to it."
    ),
    (
        "Started 45° off its sinusoid, PID drives joint 2 over it; joint 3 is hardly disturbed at a loop gain "
        "with the amplifier's 28 in it. The overshoot of joint 3 in figure 8.7 does not come out with the printed "
        "numbers."
    ),
)
"""Findings of the reproduction beyond the source."""


def _ratios(case: ControlCase) -> str:
    first, last = case.first_amplitude_ratio, case.amplitude_ratio
    return f"amplitudes × {_numbers(first)} in the first period, {_numbers(last)} in the last"


def _rms(case: ControlCase) -> str:
    return "/".join(f"{math.degrees(v):.1f}" for v in case.rms) + "°"


def _numbers(values: Triple) -> str:
    return "/".join(f"{v:.2f}" for v in values)


def _all_less(a: Triple, b: Triple) -> bool:
    return all(x < y for x, y in zip(a, b, strict=True))


def _triple(values: Floats) -> Triple:
    return float(values[0]), float(values[1]), float(values[2])


def _columns(values: Floats) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(map(float, column)) for column in values.T)
