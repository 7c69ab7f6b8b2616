"""The pure rules of the queue: states, order, schedule."""

from datetime import UTC, datetime, timedelta
from typing import Any, get_args
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, Trajectory
from daq.contracts.machine import load_machine
from daq.contracts.service.experiments import ENDS
from daq.trajectories.length import least_length, points_of
from daq.trajectories.planner import plan, start_angles
from server.experiments.schedule import (
    LONGEST,
    Plan,
    first,
    following,
    in_words,
    is_due,
    last,
    times,
    together,
    zone_here,
)
from server.experiments.states import Ending, Event, IllegalEventError, Waiting, advance, after_restart, next_due
from server.problems import ProblemError

START = datetime(2026, 1, 1, tzinfo=UTC)
moments = st.datetimes(datetime(2026, 1, 1), datetime(2027, 1, 1)).map(lambda moment: moment.replace(tzinfo=UTC))


class ExperimentLife(RuleBasedStateMachine):
    """Whatever happens, in whatever order."""

    def __init__(self) -> None:
        super().__init__()
        self.state = "queued"
        self.runs = 0
        self.past = ["queued"]

    @rule(event=st.sampled_from(Event))
    def happens(self, event: Event) -> None:
        try:
            after = advance(self.state, event)  # type: ignore[arg-type]
        except IllegalEventError:
            return
        self.runs += event is Event.TAKEN
        self.state = after
        self.past.append(after)

    @rule()
    def the_service_begins_again(self) -> None:
        self.state = after_restart(self.state)  # type: ignore[arg-type]
        self.past.append(self.state)

    @invariant()
    def it_runs_once_at_most_and_an_end_is_an_end(self) -> None:
        assert self.runs <= 1
        ended = [index for index, state in enumerate(self.past) if state in ENDS]
        assert not ended or set(self.past[ended[0] :]) == {self.past[ended[0]]}

    @invariant()
    def after_a_restart_nothing_is_running(self) -> None:
        assert after_restart(self.state) != "running"  # type: ignore[arg-type]


TestExperimentLife = ExperimentLife.TestCase
TestExperimentLife.settings = settings(max_examples=50, stateful_step_count=20)  # six states, seven events


@pytest.mark.parametrize("event", sorted(set(Event) - {Event.TAKEN, Event.CANCELLED}))
def test_what_waits_can_only_be_taken_or_cancelled(event: Event) -> None:
    with pytest.raises(IllegalEventError, match=f"an experiment that is queued cannot be {event}"):
        advance("queued", event)


def test_a_run_that_left_a_part_of_its_trace_was_stopped_and_any_other_is_called_by_its_state() -> None:
    assert Ending(Event.STOPPED, "by anna", "stopped").word == "stopped"
    assert Ending(Event.STOPPED, "cancelled before it moved").word == "cancelled"
    assert Ending(Event.FAULT, "joint 2", "fault").word == "failed"


waiting = st.lists(
    st.builds(
        Waiting,
        id=st.uuids().map(str),
        sequence=st.integers(0, 10**6),
        priority=st.integers(-100, 100),
        at=st.none() | moments,
    ),
    unique_by=lambda one: one.sequence,
)


@given(waiting, moments)
def test_the_next_is_due_and_nothing_due_goes_before_it(all_of_them: list[Waiting], now: datetime) -> None:
    chosen = next_due(all_of_them, now)
    due = [one for one in all_of_them if one.at is None or one.at <= now]
    if chosen is None:
        assert not due
        return
    assert chosen in due
    for other in due:
        assert (chosen.priority, -chosen.sequence) >= (other.priority, -other.sequence)


@given(waiting, moments, st.timedeltas(timedelta(0), timedelta(days=100)))
def test_a_clock_that_is_set_back_reorders_nothing(all_of_them: list[Waiting], now: datetime, back: timedelta) -> None:
    at_once = [one for one in all_of_them if one.at is None]
    assert next_due(at_once, now) == next_due(at_once, now - back)


intervals = st.floats(10, 10**6)


@given(moments, intervals, moments, moments, st.integers(0, 50))
def test_the_following_run_is_the_first_of_the_grid_after_the_last_and_after_what_was_missed(
    starts: datetime, every: float, last: datetime, now: datetime, made: int
) -> None:
    plan = Plan(starts, every, None)
    found = following(plan, made, last, now)
    assert found is not None
    assert found > last
    assert found >= starts
    before = found - timedelta(seconds=every)
    assert before < starts or before <= max(last, now) + timedelta(milliseconds=1)
    assert found > now - timedelta(milliseconds=1)
    steps = (found - starts).total_seconds() / every
    assert abs(steps - round(steps)) * every < 1e-3


def test_rules_are_told_in_words_with_their_last_run_and_those_that_share_a_minute_are_found() -> None:
    def plan(cron: str | None, every: float = 0.0, count: int | None = None, zone: str = "Europe/London") -> Plan:
        return Plan(START, every, count, cron, zone if cron else None)

    daily, most = plan("0 2 * * *", count=10), plan("0 2 * * 0,2,3,4,5,6")
    assert [in_words(one) for one in (daily, most, plan("30 22 * * 1,5", zone="Etc/UTC"), plan("0 2 1 * *"))] == [
        "daily at 02:00 (Europe/London)",
        "Tue-Sun at 02:00 (Europe/London)",
        "Mon, Fri at 22:30 (UTC)",
        "at 0 2 1 * * (Europe/London)",
    ]
    assert [in_words(plan(None, every)) for every in (10, 90, 1800, 172800)] == [
        "every 10 s",
        "every 90 s",
        "every 30 min",
        "every 2 d",
    ]
    assert last(daily, 3, first(daily)) == datetime(2026, 1, 7, 2, tzinfo=UTC)
    assert last(most, 0, first(most)) is None

    def meet(one: Plan, other: Plan) -> datetime | None:
        return together(times(one, 0, first(one)), times(other, 0, first(other)))

    assert meet(daily, most) == START + timedelta(hours=2)
    assert meet(most, plan("0 2 * * 1")) is None
    assert meet(daily, plan("0 2 12 1 *")) is None  # ten runs are over by then
    again = Plan(START + timedelta(seconds=5), 1800, None)
    assert meet(plan(None, 1800), again) == START  # pressed twice
    assert meet(plan(None, 1800), Plan(START + timedelta(minutes=10), 1800, None)) is None


@given(moments, intervals, st.integers(1, 20))
def test_a_schedule_with_a_count_makes_that_many_runs(starts: datetime, every: float, count: int) -> None:
    plan, moment, made = Plan(starts, every, count), starts, 0
    while is_due(moment, moment):
        made += 1
        found = following(plan, made, moment, moment)
        if found is None:
            break
        assert found > moment
        moment = found
    assert made == count


def _repeated(amplitude: float, **more: object) -> ExperimentSpec:
    return ExperimentSpec.model_validate(
        {"trajectory": {"kind": "step", "amplitude": amplitude}, "joints": [1], **more}
    )


def test_the_least_length_has_settling_and_holding_of_every_repeat() -> None:
    machine = load_machine("ma2000")
    spec = _repeated(0.0, repeats=5, settle=0.5, hold=2.0)  # no way back: only the step's own set point is not in it
    planned = plan(spec, machine, start_angles(spec, machine))
    assert least_length(spec) == pytest.approx(planned.duration, abs=5 * planned.period + 1e-9)


def test_what_the_ways_back_make_too_long_is_refused_by_the_planner() -> None:
    machine = load_machine("ma2000")
    spec = _repeated(3.0, repeats=1000, hold=0.0)
    assert least_length(spec) < LONGEST
    with pytest.raises(SpecError, match="at most 4 h are allowed"):
        plan(spec, machine, start_angles(spec, machine))


VIA = {"kind": "via", "points": [0.01, 0.02], "times": [2.0, 4.0]}
OF_EVERY_KIND: tuple[tuple[dict[str, Any], float, int], ...] = (
    ({"kind": "ramp", "duration": 4.0}, 4.0, 0),
    ({"kind": "step"}, 0.0, 0),
    ({"kind": "staircase", "steps": 4, "dwell": 0.5}, 4.0, 0),
    ({"kind": "slow_ramp", "amplitude": 0.1, "speed": 0.1, "reversals": 3}, 4.0, 0),
    ({"kind": "sine", "period": 2.0, "cycles": 2.0}, 4.0, 0),
    ({"kind": "multisine", "duration": 4.0}, 4.0, 0),
    ({"kind": "cubic", "duration": 4.0}, 4.0, 0),
    (VIA, 4.0, 2),
    ({"kind": "pick_and_place", "pick": 1.0, "travel": 2.0, "place": 1.0}, 4.0, 0),
    ({"kind": "path", "times": [0.0, 4.0], "positions": [[0.0] * 3] * 2}, 4.0, 2),
    ({"kind": "pause", "duration": 4.0}, 4.0, 0),
    ({"kind": "sequence", "segments": [{"move": VIA}, {"move": {"kind": "pause", "duration": 1.0}}]}, 5.0, 3),
)


@pytest.mark.parametrize(("trajectory", "length", "points"), OF_EVERY_KIND, ids=lambda one: str(one)[10:15])
def test_every_kind_of_motion_is_as_long_as_it_says(trajectory: dict[str, Any], length: float, points: int) -> None:
    spec = ExperimentSpec.model_validate({"trajectory": trajectory, "settle": 0.0, "hold": 0.0})
    assert least_length(spec) == pytest.approx(length)
    assert points_of(spec) == points


def test_no_kind_of_motion_is_left_out() -> None:
    kinds = {one.model_fields["kind"].default for one in get_args(get_args(Trajectory)[0])}
    assert {trajectory["kind"] for trajectory, _, _ in OF_EVERY_KIND} == kinds


@pytest.mark.parametrize("cron", ["0 2 * * *", "30 2 * * *", "*/60 2 * * *"])
@pytest.mark.parametrize(
    ("begin", "hours"),
    [
        # 02:00 to 03:00 is left out on 29 March 2026 in Berlin; it comes twice on 25 October.
        (datetime(2026, 3, 27, 12, tzinfo=UTC), [2, 3, 2]),
        (datetime(2026, 10, 23, 12, tzinfo=UTC), [2, 2, 2]),
    ],
)
def test_a_nightly_run_comes_once_a_night_also_when_the_clocks_change(
    cron: str, begin: datetime, hours: list[int]
) -> None:
    berlin = ZoneInfo("Europe/Berlin")
    plan = Plan(begin, 0.0, None, cron, "Europe/Berlin")
    runs = [first(plan)]
    while len(runs) < 3 and runs[-1] is not None:
        runs.append(following(plan, len(runs), runs[-1], runs[-1] + timedelta(minutes=1)))
    local = [run.astimezone(berlin) for run in runs if run is not None]
    assert [run.hour for run in local] == hours
    assert [run.date() for run in local] == [(begin + timedelta(days=day)).date() for day in (1, 2, 3)]


@pytest.mark.parametrize(
    ("cron", "hours"),
    [("*/30 2 * * *", ["02:00", "02:30"]), ("0 */2 * * *", ["02:00", "04:00"]), ("0 * * * *", ["02:00", "02:00"])]
    + [(f"0 {hours} * * *", ["02:00", "02:00"]) for hours in ("*/1", "0-23", "0-23/1", "0-11,12-23")],
)
def test_steps_of_the_clock_come_once_when_it_is_put_back_and_every_hour_means_every_hour(
    cron: str, hours: list[str]
) -> None:
    berlin = ZoneInfo("Europe/Berlin")
    plan = Plan(datetime(2026, 10, 25, 1, 55, tzinfo=berlin).astimezone(UTC), 0.0, None, cron, "Europe/Berlin")
    begun = first(plan)
    assert begun is not None
    later = following(plan, 1, begun, begun)
    assert later is not None
    assert [f"{run.astimezone(berlin):%H:%M}" for run in (begun, later)] == hours


def test_a_cron_run_at_the_very_start_counts_and_missed_ones_are_left_out() -> None:
    plan = Plan(datetime(2026, 1, 1, 2, tzinfo=UTC), 0.0, 2, "0 2 * * *", "UTC")
    begun = first(plan)
    assert begun == plan.starts
    assert following(plan, 1, begun, datetime(2026, 1, 5, 2, 30, tzinfo=UTC)) == datetime(2026, 1, 6, 2, tzinfo=UTC)
    assert following(plan, 2, begun, begun) is None, "its number of runs is reached"
    assert following(plan, 1, begun, begun - timedelta(days=9)) == begun + timedelta(days=1), "the clock is set back"


@pytest.mark.parametrize(
    ("cron", "zone", "field"),
    [
        ("0 25 * * *", "UTC", "cron"),
        ("* * * * * *", "UTC", "cron"),
        ("nightly at two", "UTC", "cron"),
        ("0 2 30 2 *", "UTC", "cron"),
        ("0 2 * * *", "Europe/Nowhere", "zone"),
        ("0 2 * * *", "../../etc/passwd", "zone"),
    ],
)
def test_a_cron_expression_that_never_comes_is_refused_in_one_line(cron: str, zone: str, field: str) -> None:
    with pytest.raises(ProblemError, match=f"^{field}: ") as refused:
        first(Plan(START, 0.0, None, cron, zone))
    assert "\n" not in refused.value.detail


def test_the_time_zone_of_this_computer_has_a_name() -> None:
    assert ZoneInfo(zone_here()).key == zone_here()
