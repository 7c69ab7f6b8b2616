"""Which snapshots show a missed set point: not the ones within the pipeline of one period, all older ones."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from daq.driver.set_point_watch import SetPointWatch
from firmware_protocol.joints import JointReading
from firmware_protocol.units import counts_to_posture, posture_to_counts


def shows(*postures: int) -> tuple[tuple[int, JointReading], ...]:
    return tuple((joint, JointReading(posture, 2048, 0, 0)) for joint, posture in enumerate(postures, 1))


def test_nothing_is_missed_before_anything_was_sent() -> None:
    assert not SetPointWatch().missed(1, shows(500, 500))


def test_the_period_after_the_confirmed_one_must_show_what_was_sent() -> None:
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=8)
    assert not watch.missed(7, shows(500)), "on its way: the old one is right"
    assert watch.missed(8, shows(500))
    assert watch.missed(9, shows(500))
    assert not watch.missed(10, shows(510))


def test_a_batch_may_show_before_its_confirmation_has_come() -> None:
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=8)
    late = watch.sending({1: 511})  # its first confirmation is lost on the way
    assert not watch.missed(9, shows(511))
    watch.confirmed(late, due=11)
    assert watch.missed(11, shows(510))


def test_joints_that_were_sent_earlier_keep_their_set_points() -> None:
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=5)
    watch.confirmed(watch.sending({2: 520}), due=6)
    assert not watch.missed(6, shows(510, 520))
    assert watch.missed(7, shows(500, 520))
    assert not watch.missed(8, ((3, JointReading(1, 0, 0, 0)),)), "nothing was sent to this joint"


def test_a_refused_batch_is_not_missed() -> None:
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=5)
    watch.withdrawn(watch.sending({1: 600}))
    assert not watch.missed(6, shows(510))
    assert watch.missed(6, shows(600)), "nobody sent it that counts"
    watch.confirmed(watch.sending({2: 520}), due=7)
    assert not watch.missed(7, shows(510, 520))


def test_after_a_stop_the_frozen_set_points_are_the_right_ones() -> None:
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=5)
    watch.replaced({1: 505}, due=7)
    assert not watch.missed(6, shows(510))
    assert not watch.missed(7, shows(505))
    assert watch.missed(8, shows(510))


def test_a_set_point_read_back_through_position_and_error_is_the_one_sent() -> None:
    assert all(counts_to_posture(posture_to_counts(posture)) == posture for posture in range(1000))


@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=60))
def test_a_controller_that_takes_everything_is_never_accused_and_one_that_skips_always_is(
    periods: list[tuple[bool, bool]],
) -> None:
    """Each period: is a new set point sent before it; does the controller find the memory free."""
    watch = SetPointWatch()
    memory = taken = 500
    for tick, (sends, free) in enumerate(periods, 1):
        if sends:
            memory = 500 + tick
            watch.confirmed(watch.sending({1: memory}), due=tick)
        if free:
            taken = memory
        assert watch.missed(tick, shows(taken)) == (taken != memory)
