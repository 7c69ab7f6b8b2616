"""The console's language is the command line's, macros fill it in, and the calendar agrees with the queue."""

import math
from datetime import UTC, datetime, timedelta
from typing import Any
from zoneinfo import ZoneInfo

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, Multisine, Path, Ramp, Sine, SlowRamp, Step
from daq.contracts.machine import load_machine
from daq.contracts.service.experiments import Schedule
from daq.trajectories.presets import PRESETS
from extras.console.calendar import planned
from extras.console.language import commands, read, with_rule
from extras.console.macros import examples, expand
from extras.console.messages import Macro
from extras.console.written import line_of
from server.experiments.schedule import Plan, following
from server.problems import ProblemError

MACHINE = load_machine("ma2000")
ANGLES = st.floats(-3.0, 3.0, allow_subnormal=False)
TIMES = st.floats(1e-3, 3600.0)
MOTIONS = st.one_of(
    st.builds(Ramp, amplitude=ANGLES | st.fixed_dictionaries({1: ANGLES, 3: ANGLES}), duration=TIMES),
    st.builds(Step, amplitude=ANGLES),
    st.builds(SlowRamp, amplitude=ANGLES, speed=st.floats(1e-3, 3.0), reversals=st.integers(0, 200)),
    st.builds(Sine, amplitude=ANGLES, period=TIMES, cycles=st.floats(0.1, 1000), phase=ANGLES),
    st.builds(Multisine, amplitude=ANGLES, seed=st.integers(0, 2**63 - 1)),
)
SPECS = st.builds(
    ExperimentSpec,
    trajectory=MOTIONS,
    joints=st.just((1, 3)),
    start=st.dictionaries(st.integers(1, 6), ANGLES, max_size=2),
    gains=st.dictionaries(st.integers(1, 6), st.tuples(*[st.integers(0, 20)] * 3), max_size=2),
    hold=st.floats(0, 3600),
    repeats=st.integers(1, 1000),
    notes=st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=40),
)


@given(SPECS)
def test_the_line_written_for_an_experiment_reads_back_as_the_same_experiment(spec: ExperimentSpec) -> None:
    order = read(line_of(spec, MACHINE), MACHINE)
    assert order.spec == spec
    assert not order.dry_run


def test_every_preset_has_a_line_and_a_path_says_that_it_has_none() -> None:
    for name, one in PRESETS.items():
        assert line_of(one.spec, MACHINE) == f"run preset {name}"
    path = ExperimentSpec(trajectory=Path(times=(0.0, 1.0), positions=((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))))
    with pytest.raises(SpecError, match="a path has no line"):
        line_of(path, MACHINE)


def test_a_line_is_read_by_the_command_lines_own_parser() -> None:
    order = read("daq run ramp --joints 2 --amplitude 5 --daily 02:30 --dry-run", MACHINE)
    assert order.words == ("run", "ramp")
    assert order.spec is not None
    assert order.spec.joints == (2,)
    assert order.spec.trajectory == Ramp(amplitude=math.radians(5))
    assert (order.cron, order.dry_run) == ("30 2 * * *", True)
    planned_now = with_rule(order, datetime(2026, 3, 2, 12, tzinfo=UTC))
    assert planned_now.rule.startswith("daily at 02:30 (")
    assert planned_now.next is not None
    with pytest.raises(ProblemError, match="five fields"):
        with_rule(order.model_copy(update={"cron": "daily"}), datetime(2026, 3, 2, 12, tzinfo=UTC))
    described = {one.words: one for one in commands()}
    assert ("run", "spec") not in described
    assert ("queue", "resume") in described
    flags = [flag for one in described["run", "ramp"].options for flag in one.flags]
    assert "--amplitude" in flags
    assert not {"--yes", "--folder", "--json"} & set(flags)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("rn ramp", "no such command; there are help, run, stop"),
        ("run", "run: needs one of ramp, step"),
        ("run spec file.json", "not 'spec'"),
        ("mock --seed 3", "mock: not in the console; type it in a terminal"),
        ("run ramp --jonts 2", "run ramp: no such option: --jonts"),
        ("run ramp --yes", "no such option: --yes"),
        ("run ramp --folder /tmp", "no such option: --folder"),
        ("run ramp --repeats x", "invalid value for '--repeats'"),
        ("run ramp --amplitude 30mm", "joint 1 turns: write an angle"),
        ("run ramp --amplitude 'x", "no closing quotation"),
        ("run preset nothing", "nothing"),
        ("run ramp --help", "no such option: --help"),
        (" ", "no such command"),
    ],
)
def test_a_wrong_line_is_refused_in_one_line(line: str, said: str) -> None:
    with pytest.raises(SpecError) as refused:
        read(line, MACHINE)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_examples_expand_and_their_schema_is_one_that_others_understand() -> None:
    for macro in examples():
        reading = expand(macro, {}, MACHINE)
        jsonschema.Draft202012Validator.check_schema(reading.parameters)
        defaults = {name: one["default"] for name, one in dict(reading.parameters.get("properties", {})).items()}
        jsonschema.validate(defaults, reading.parameters)
        assert all(order.spec is not None and order.spec.name for order in reading.orders)


def _macro(**changes: Any) -> Macro:
    words = {"name": "one", "parameters": [{"name": "a", "default": 5, "minimum": 1, "maximum": 9}]}
    return Macro.model_validate({**words, "lines": ["run ramp --amplitude {a}"], **changes})


TEXT = [{"name": "a", "type": "text", "default": "1"}]


@pytest.mark.parametrize(
    ("macro", "values", "said"),
    [
        (_macro(), {"a": 10}, "one: a: "),
        (_macro(), {"b": 1}, "one: b: "),
        (_macro(), {"a": "much"}, "one: a: "),
        (_macro(lines=["stop {a}"]), {}, "one, line 1: a macro has lines of `run` alone"),
        (_macro(lines=["queue pause"], parameters=[]), {}, "lines of `run` alone"),
        (_macro(lines=["run ramp --dry-run --amplitude {a}"]), {}, "without --dry-run"),
        (_macro(parameters=TEXT), {"a": "1 --cron '* * * * *'"}, "amplitude"),
    ],
)
def test_a_value_stays_in_its_place_and_what_is_wrong_is_named(
    macro: Macro, values: dict[str, bool | int | float | str], said: str
) -> None:
    with pytest.raises(SpecError) as refused:
        expand(macro, values, MACHINE)
    assert said in str(refused.value)


def test_a_macros_parameters_and_places_must_agree() -> None:
    with pytest.raises((ValidationError, SpecError), match="no parameter"):
        _macro(lines=["run ramp --amplitude {b}"])
    with pytest.raises((ValidationError, SpecError), match="no line uses"):
        _macro(lines=["run ramp"])


def _schedule(**changes: Any) -> Schedule:
    now = datetime(2026, 3, 27, 12, tzinfo=UTC)
    plain = {"id": "a", "robot": "r", "spec": ExperimentSpec(), "every": None, "starts": now, "count": None}
    more = {"priority": 0, "active": True, "submitted_runs": 0, "created": now, "created_by": "Ann", "content": ""}
    return Schedule.model_validate({**plain, **more, **changes})


def test_a_nightly_plan_stays_at_its_hour_when_clocks_change() -> None:
    zone, begin = ZoneInfo("Europe/London"), datetime(2026, 3, 27, 12, tzinfo=UTC)
    plan = Plan(begin, 0.0, None, "0 4 * * *", "Europe/London")
    one = _schedule(cron=plan.cron, zone=plan.zone, next=following(plan, 0, begin, begin))
    runs = planned([one], [], begin, begin + timedelta(days=4))
    assert [run.at.astimezone(zone).strftime("%d %H:%M") for run in runs] == [
        "28 04:00",
        "29 04:00",
        "30 04:00",
        "31 04:00",
    ]
    later = planned([one], [], begin + timedelta(days=30), begin + timedelta(days=31))
    assert [run.at.astimezone(zone).strftime("%d %H:%M") for run in later] == ["27 04:00"]


def test_a_plan_that_ends_or_is_off_shows_no_more_than_it_will_do() -> None:
    begin = datetime(2026, 3, 27, 12, tzinfo=UTC)
    ends = _schedule(every=3600.0, count=5, submitted_runs=2, next=begin + timedelta(hours=2))
    assert len(planned([ends], [], begin, begin + timedelta(days=3))) == 3
    assert len(planned([ends], [], begin + timedelta(hours=3), begin + timedelta(days=3))) == 2
    assert planned([_schedule(every=60.0, active=False, next=None)], [], begin, begin + timedelta(days=3)) == ()
