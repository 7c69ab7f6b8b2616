"""The gap of the closed loop: root mean squares of an arm that follows nothing of the record, stage by stage."""

from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
import pytest

from daq.contracts.machine import Machine
from model.arrays import Floats
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.output_error.case import Case, _within_file, closed_loop_gap
from model.discrepancy.output_error.observation import Signals, observe
from model.discrepancy.output_error.search import Point, converge, point_at
from tests.model.discrepancy.steps import step
from tests.model.fitting import imagined

WAVE = 0.01
"""rad: a square wave on the readings that no motion of the arm made."""


def test_what_the_readings_say_beside_the_motion_is_the_gap_whatever_the_search_let_the_simulation_follow() -> None:
    """The model is the arm, so that the whole gap is the wave, whose root mean square is its height. It begins with the
    first sample that is compared, 0.4 s after the start."""
    recorded = imagined.trace(imagined.arm(), seconds=3.0, noise=0.0)
    later = np.arange(len(recorded)) >= 20
    sign = np.where(np.arange(len(recorded)) // 10 % 2, -1.0, 1.0) * later
    waved = imagined.changed(recorded, position=recorded.position + WAVE * sign[:, None] * np.array([1.0, 0.0, 2.0]))
    observation, given = observe(imagined.arm(), [waved], feedback_share=0.5)
    given = given.at(np.array([u.start for u in given.unknowns]))
    begin = point_at(observation, given)
    case = Case(
        model=imagined.arm(),
        given=begin,
        traces=(waved,),
        scoring=observation.with_drive_as_input(True),
        floor=observation.deviations,
        held=None,
        floor_held=np.zeros(0),
        options=DiagnosisOptions(),
    )
    gap = closed_loop_gap(case, begin, [], begin)
    for stage in gap.stages:
        assert stage.fitted == pytest.approx((WAVE, 0.0, 2 * WAVE), rel=0.01, abs=5e-4)
        assert stage.held_out == ()
    assert (gap.measure, gap.joints, gap.units) == ("closed-loop", (1, 2, 3), ("rad",) * 3)


@dataclass(frozen=True)
class Readings:
    """An observation whose residuals are made by hand: of the closed loop, and smaller ones while it follows."""

    closed: dict[str, Signals]
    machine: Machine = field(default_factory=imagined.machine)
    units: tuple[str, ...] = ("rad",) * 3
    sizes: Floats = field(default_factory=lambda: np.array([0.1, 0.2, 0.3]))
    drive: bool = True
    share: float = 0.9

    def with_drive_as_input(self, recorded: bool) -> "Readings":
        return replace(self, drive=recorded)

    def with_feedback_share(self, share: float) -> "Readings":
        return replace(self, share=share)

    def residuals(self, point: str) -> Signals:
        return tuple((1.0 - self.share) * (0.5 if self.drive else 1.0) * own for own in self.closed[point])

    def rms(self, signals: Signals) -> list[float]:
        return [float(np.sqrt(np.mean(column**2))) for column in np.concatenate(signals).T]


@dataclass(frozen=True)
class Held:
    observation: Readings

    def residuals(self, point: str) -> Signals:
        return self.observation.residuals(point)


def of(*columns: tuple[float, float]) -> Signals:
    return (np.array(columns).T,)


FITTED = {
    "given": of((3.0, 4.0), (5.0, -5.0), (0.0, 2.0)),
    "fitted": of((1.0, 1.0), (1.0, -1.0), (np.inf, 1.0)),
    "friction": of((0.6, 0.8), (0.0, 0.0), (7.0, 1.0)),
    "end": of((0.3, 0.4), (0.0, 0.0), (7.0, 1.0)),
}
HELD = {name: (10.0 * signals[0],) for name, signals in FITTED.items()}


def case_of(held: Held | None) -> Case:
    plain: Any = Readings(FITTED)
    return Case(
        model=imagined.arm(),
        given=cast(Point, "given"),
        traces=(),
        scoring=plain,
        floor=plain.sizes,
        held=cast(Any, held),
        floor_held=np.zeros(0),
        options=DiagnosisOptions(),
    )


@pytest.mark.parametrize("held", [Held(Readings(HELD)), None], ids=["held-out", "none"])
def test_each_stage_has_the_root_mean_square_of_its_own_point(
    held: Held | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken = [(step("coulomb_friction", (2,)), cast(Point, "friction"))]
    monkeypatch.setattr("model.discrepancy.output_error.case._numbers", lambda *_points: ())
    monkeypatch.setattr("model.discrepancy.output_error.case._within_file", lambda point: point)
    gap = closed_loop_gap(case_of(held), cast(Point, "fitted"), taken, cast(Point, "end"))
    rms = [(12.5**0.5, 5.0, 2.0**0.5), (0.5**0.5, 0.0, 5.0), (0.125**0.5, 0.0, 5.0)]
    assert [(s.kind, s.effect, s.joints) for s in gap.stages] == [
        ("given", None, ()),
        ("effect", "coulomb_friction", (2,)),
        ("refitted", None, ()),
    ]
    assert gap.without is not None
    assert gap.without.fitted == (1.0, 1.0, None), "the numbers alone"
    for stage, numbers in zip(gap.stages, rms, strict=True):
        assert list(stage.fitted) == [n if n is None else pytest.approx(n) for n in numbers]
        theirs = [] if held is None else [n if n is None else pytest.approx(10 * n) for n in numbers]
        assert list(stage.held_out) == theirs
    assert gap.noise == (0.1, 0.2, 0.3)


def test_within_what_the_file_states_no_number_is_further_off_than_one_deviation() -> None:
    """The record is of a heavier arm: numbers that are free go far from the file, and these do not."""
    heavy = imagined.arm().with_values({"link2.mass": 4.0 * imagined.arm().parameter("link2.mass").value})
    observation, given = observe(imagined.arm(), [imagined.trace(heavy, seconds=3.0)])
    free = converge(point_at(observation, given.at(np.array([u.start for u in given.unknowns]))), 4)
    bounded = _within_file(free)
    assert free.strain > 1.0
    assert bounded.strain <= 1.0 + 1e-9
    assert bounded.cost <= free.at_expected().cost
