"""Which snapshots show a missed set point: not the ones within the pipeline of one period, all older ones."""

from hypothesis import given
from hypothesis import strategies as st

from daq.driver.set_point_watch import SetPointWatch, Used
from firmware_protocol.joints import JointReading
from firmware_protocol.units import counts_to_posture, posture_to_counts


def shows(*postures: int) -> tuple[tuple[int, JointReading], ...]:
    return tuple((joint, JointReading(posture, 2048, 0, 0)) for joint, posture in enumerate(postures, 1))


def missed(watch: SetPointWatch, tick: int, joints: tuple[tuple[int, JointReading], ...]) -> bool:
    return watch.seen(tick, joints).missed


def test_the_period_after_the_confirmed_one_must_show_what_was_sent() -> None:
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=8)
    assert not missed(watch, 7, shows(500)), "on its way: the old one is right"
    assert missed(watch, 8, shows(500))
    assert missed(watch, 9, shows(500))
    assert not missed(watch, 10, shows(510))


def test_a_batch_may_show_before_its_confirmation_has_come() -> None:
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=8)
    late = watch.sending({1: 511})  # its first confirmation is lost on the way
    assert not missed(watch, 9, shows(511))
    watch.confirmed(late, due=11)
    assert missed(watch, 11, shows(510))


def test_joints_that_were_sent_earlier_keep_their_set_points() -> None:
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=5)
    watch.confirmed(watch.sending({2: 520}), due=6)
    assert not missed(watch, 6, shows(510, 520))
    assert missed(watch, 7, shows(500, 520))
    assert not missed(watch, 8, ((3, JointReading(1, 0, 0, 0)),)), "nothing was sent to this joint"


def test_a_refused_batch_is_not_missed() -> None:
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=5)
    watch.withdrawn(watch.sending({1: 600}))
    assert not missed(watch, 6, shows(510))
    assert missed(watch, 6, shows(600)), "nobody sent it that counts"
    watch.confirmed(watch.sending({2: 520}), due=7)
    assert not missed(watch, 7, shows(510, 520))


def test_after_a_stop_the_frozen_set_points_are_the_right_ones() -> None:
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=5)
    watch.replaced({1: 505}, due=7)
    assert not missed(watch, 6, shows(510))
    assert not missed(watch, 7, shows(505))
    assert missed(watch, 8, shows(510))


def test_a_period_tells_since_when_its_set_points_are_used() -> None:
    watch = SetPointWatch()
    assert watch.seen(4, shows(500)).since is None, "nobody sent them"
    watch.confirmed(watch.sending({1: 510}), due=6)
    watch.confirmed(watch.sending({1: 520}), due=9)
    assert watch.seen(8, shows(510)).since == 6
    assert watch.seen(8, shows(520)).since == 8, "a period earlier than it was due: it was used at once"
    assert watch.seen(12, shows(520)).since == 9
    assert watch.seen(13, shows(510)) == Used(missed=True), "it has been replaced"
    watch.sending({1: 530})
    assert watch.seen(14, shows(530)).since is None, "its confirmation is still to come"


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
        assert missed(watch, tick, shows(taken)) == (taken != memory)
