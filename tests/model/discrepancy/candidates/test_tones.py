"""Ripples and disturbances are proposed at their frequency, on joints that have a tone already too."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.machine import Machine
from daq.contracts.quantity import Quantity
from model.discrepancy.candidates.library import tone
from model.discrepancy.candidates.tones import USUAL_TONES, propose_tones, rates_tried, tones_tried, torque_response
from model.discrepancy.output_error.observation import Observation, observe
from model.discrepancy.output_error.search import Point, point_at
from model.machine_model.model import Model
from tests.model.discrepancy.motions import trace_of
from tests.model.fitting import imagined

HUM = {"sine": 0.5, "cosine": 0.2, "frequency": 1.7}
RIPPLE = {"sine": 1.0, "cosine": 0.0, "cycles": 40.0}


def seen(truth: Model, known: Model, seconds: float = 20.0) -> Point:
    """A record of `truth`, and what `known` leaves of it."""
    return point_at(*observe(known, [trace_of(truth, seconds)]))


def looked_at(seconds: float) -> Observation:
    """A record of that length."""
    return observe(imagined.arm(), [imagined.trace(imagined.arm(), seconds=seconds)])[0]


@pytest.mark.parametrize("has_hum", [False, True])
def test_a_ripple_is_proposed_at_its_cycles(has_hum: bool) -> None:
    """Also on a joint whose disturbance is known: that one is not moved to find it."""
    known = imagined.arm().with_effect("periodic_disturbance", (2,), HUM) if has_hum else imagined.arm()
    found = propose_tones(seen(known.with_effect("torque_ripple", (2,), RIPPLE), known), (2,))
    assert has_hum == ("periodic_disturbance" not in {p.hypothesis.name for p in found})
    best = found[0]
    assert best.hypothesis.name == "torque_ripple"
    assert best.start["joint2.torque_ripple.cycles"] == pytest.approx(40.0, abs=3.0)
    assert np.hypot(*(best.start[f"joint2.torque_ripple.{p}"] for p in ("sine", "cosine"))) == pytest.approx(1, rel=0.5)


def test_a_ripple_may_not_become_so_slow_that_it_is_a_spring() -> None:
    """A spring on a joint is like a part of one slow wave: a wave that is fitted keeps half of itself on the travel."""
    arm = imagined.arm().with_effect("spring_torque", (2,), {"stiffness": 8.0})
    point = seen(arm, imagined.arm())
    found = next(p for p in propose_tones(point, (2,)) if p.hypothesis.name == "torque_ripple")
    travel = float(np.ptp(point.observation.records[0].measured[:, 1]))
    low, _ = found.hypothesis.bounds["joint2.torque_ripple.cycles"]
    assert low == pytest.approx(np.pi / travel, rel=1e-6)
    assert found.start["joint2.torque_ripple.cycles"] >= low


def test_the_response_to_a_torque_is_the_same_beside_a_tone() -> None:
    plain = torque_response(seen(imagined.arm(), imagined.arm()), 2)
    humming = imagined.arm().with_effect("periodic_disturbance", (2,), HUM)
    beside = torque_response(seen(humming, humming), 2)
    lags = imagined.PERIOD * np.arange(len(plain))
    slow = np.exp(-2j * np.pi * np.linspace(0.7, 4.3, 20)[:, None] * lags)
    apart = np.linalg.norm(slow @ (beside - plain)) / np.linalg.norm(slow @ plain)
    assert apart < 0.3


def test_a_joint_with_both_kinds_of_tones_gets_no_third() -> None:
    known = imagined.arm().with_effect("periodic_disturbance", (2,), HUM).with_effect("torque_ripple", (2,), RIPPLE)
    point = seen(known, known, seconds=3.0)
    assert propose_tones(point, (2,)) == []
    assert {p.hypothesis.joints for p in propose_tones(point, (1, 2))} == {(1,)}


@pytest.mark.parametrize("seconds", [6.0, 55.0, 180.0])
def test_no_disturbance_falls_between_the_tones_that_are_tried(seconds: float) -> None:
    observation = looked_at(seconds)
    rates = rates_tried(observation, "periodic_disturbance", 1)
    assert np.diff(rates).max() <= 1.0 / seconds + 1e-12
    assert rates[-1] == 8.0
    hypothesis = tone(imagined.arm(), "periodic_disturbance", 1, {"frequency": 1.0}, 0.1)
    assert hypothesis is not None
    assert tones_tried(observation, hypothesis) == max(USUAL_TONES, len(rates))


def test_a_record_of_55_s_is_searched_with_the_usual_number_of_tones() -> None:
    observation = looked_at(55.0)
    assert len(rates_tried(observation, "periodic_disturbance", 1)) == USUAL_TONES
    assert rates_tried(observation, "torque_ripple", 1)[-1] == pytest.approx(100.0)


def with_sensor(bits: int | None) -> Machine:
    """The arm with another sensor on joint 1, or with none."""
    machine = imagined.machine()
    first = machine.joint(1)
    assert first.sensor is not None
    sensor = None if bits is None else first.sensor.model_copy(update={"bits": bits})
    joints = (first.model_copy(update={"sensor": sensor}), *machine.joints[1:])
    return machine.model_copy(update={"joints": joints})


def test_the_shortest_wave_is_what_the_sensor_resolves_and_the_library_allows() -> None:
    observation = looked_at(6.0)
    shortest = {
        bits: rates_tried(replace(observation, machine=with_sensor(bits)), "torque_ripple", 1)[-1]
        for bits in (11, 12, 20, None)
    }
    assert shortest == {11: pytest.approx(50.0), 12: pytest.approx(100.0), 20: 1000.0, None: 1000.0}


def test_the_shortest_wave_of_a_sliding_joint_is_as_many_counts_long() -> None:
    """2 mm of travel a count would hide every wave under 11 cm; 10 µm a count shows those of 6 mm, the library's."""
    observation, machine = looked_at(6.0), imagined.machine()
    first = machine.joint(1)
    assert first.sensor is not None
    for resolution, highest in ((1e-3, 2 * np.pi / (1e-3 * 4096 / 75)), (1e-5, 1000.0)):
        range_ = Quantity(value=4096 * resolution, unit="m", source="test")
        sensor = first.sensor.model_copy(update={"range": range_})
        slide = first.model_copy(update={"kind": "prismatic", "sensor": sensor})
        sliding = machine.model_copy(update={"joints": (slide, *machine.joints[1:])})
        assert rates_tried(replace(observation, machine=sliding), "torque_ripple", 1)[-1] == pytest.approx(highest)


def test_no_ripple_is_looked_for_where_nothing_moves() -> None:
    points = imagined.set_points(0, 6.0)
    points[:, 0] = points[0, 0]
    still = imagined.trace(imagined.arm(), points=points, noise=0.0)
    observation = observe(imagined.arm(), [still])[0]
    assert len(rates_tried(observation, "torque_ripple", 1)) == 0
    assert len(rates_tried(observation, "torque_ripple", 2)) > 0


def test_the_response_is_taken_from_the_record_that_moves_a_joint_furthest() -> None:
    """The first is too short to show an answer of 1.5 s."""
    truth = imagined.arm().with_effect("torque_ripple", (2,), RIPPLE)
    short, long = imagined.trace(truth, 1, seconds=1.2), trace_of(truth, 20.0)
    point = point_at(*observe(imagined.arm(), [short, long]))
    ripple = next(p for p in propose_tones(point, (2,)) if p.hypothesis.name == "torque_ripple")
    assert abs(ripple.start["joint2.torque_ripple.cycles"] - RIPPLE["cycles"]) < 1.0


def test_a_record_shorter_than_the_response_proposes_no_tone() -> None:
    point = seen(imagined.arm(), imagined.arm(), seconds=1.2)
    assert propose_tones(point, (1, 2, 3)) == []
