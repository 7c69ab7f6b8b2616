"""Steps: candidates that held-out traces refuse give way to the next, and parameters are those of the last fit."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from daq.contracts.progress import Never, silent
from model.discrepancy.candidates.candidate_fit import CandidateFit, Fit
from model.discrepancy.candidates.ranking import Ranking
from model.discrepancy.diagnosis import FoundValue
from model.discrepancy.grounds import Refusal
from model.discrepancy.selection import diagnose
from model.discrepancy.selection import step as last_fit
from model.discrepancy.selection.step import _is_nothing, update_to_last_fit
from model.discrepancy.thresholds import Thresholds
from tests.model.discrepancy.candidate_fits import candidate_fit
from tests.model.discrepancy.steps import step


def after_ranking(
    monkeypatch: pytest.MonkeyPatch, fits: list[CandidateFit], holding: str | None, group: tuple[str, ...] = ()
) -> Any:
    """The search after a ranking of these fits, of which held-out traces refuse all but `holding`, in a group."""
    start, end = cast(Fit, object()), cast(Fit, object())

    def make_step(_case: Any, current: Fit, _ranking: Ranking, decision: Any) -> tuple[Any, Fit]:
        if decision.kind == "nothing":
            return None, current
        name = decision.best.hypothesis.name
        step = SimpleNamespace(effect=name, joints=(1,), evidence=1.0, adopted=name == holding, group=group)
        return step, end if step.adopted else current

    monkeypatch.setattr(diagnose, "_rank", lambda *_: (Ranking(tuple(fits), ()), start))
    monkeypatch.setattr(diagnose, "make_step", make_step)
    case = cast(Any, SimpleNamespace(thresholds=Thresholds(significant=12.0)))
    found = diagnose._add_effect(case, diagnose._Search(start, start), silent, Never())
    assert len(found.before) == len(found.steps)
    assert found.current is (end if found.added else start)
    return found


def test_the_next_candidate_is_taken_where_held_out_traces_refuse_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    found = after_ranking(
        monkeypatch, [candidate_fit("backlash", (1,), 90.0), candidate_fit("stiction", (1,), 40.0)], "stiction"
    )
    assert [(s.effect, s.adopted) for s in found.steps] == [("backlash", False), ("stiction", True)]
    assert not found.ended
    assert found.tried is None, "something was added"


def test_a_candidate_that_is_not_significant_is_not_taken_after_a_refused_one(monkeypatch: pytest.MonkeyPatch) -> None:
    found = after_ranking(
        monkeypatch, [candidate_fit("backlash", (1,), 90.0), candidate_fit("stiction", (1,), 8.0)], "stiction"
    )
    assert [s.effect for s in found.steps] == ["backlash"]
    assert found.ended
    assert found.tried is not None
    assert [f.hypothesis.name for f in found.tried.fitted] == ["backlash", "stiction"], "also what was refused"


def test_a_second_effect_is_looked_for_after_a_group(monkeypatch: pytest.MonkeyPatch) -> None:
    """The group's best stands in for the one that is there."""
    both = [candidate_fit("backlash", (1,), 90.0), candidate_fit("stiction", (1,), 88.0)]
    found = after_ranking(monkeypatch, both, "backlash", group=("backlash", "stiction"))
    assert [(s.effect, s.adopted) for s in found.steps] == [("backlash", True)]
    assert not found.ended
    assert [r.hypothesis.name for r in found.rivals] == ["backlash", "stiction"]


def test_the_search_ends_after_three_refused_candidates(monkeypatch: pytest.MonkeyPatch) -> None:
    found = after_ranking(monkeypatch, [candidate_fit(f"effect_{k}", (1,), 90.0 - 10 * k) for k in range(6)], None)
    assert len(found.steps) == diagnose.CHANCES
    assert found.ended


def removed(monkeypatch: pytest.MonkeyPatch, without: Any) -> list[str]:
    """Names of the parameters without which the last fit is made, which then is `without`."""
    gone: list[str] = []

    def taken_out(_point: Any, names: list[str]) -> Any:
        gone.extend(names)
        return without

    monkeypatch.setattr(last_fit, "_without", taken_out)
    return gone


def test_an_effect_that_a_later_one_explains_is_removed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both have come out with the same interval; only one of them has its null in it, and the newest stays anyway."""
    value = FoundValue(value=0.1, low=-0.1, high=0.3, unit="1")

    def parameter(name: str, null: float, low: float = -1.0) -> Any:
        return SimpleNamespace(name=name, null=null, low=low, effect=name, joints=(1,))

    known = {"a": parameter("a", 0.0), "b": parameter("b", 1.0), "c": parameter("c", 0.0)}
    current = cast(Any, SimpleNamespace(point=SimpleNamespace(model=SimpleNamespace(by_name=known))))
    without = cast(Any, SimpleNamespace(point=SimpleNamespace(model=SimpleNamespace(by_name=known))))
    gone = removed(monkeypatch, without)
    monkeypatch.setattr(last_fit, "shift_by_noise", lambda *_: 0.0)
    monkeypatch.setattr(last_fit, "found_values", lambda _c, own, _m: {p.name: value for p in own})
    now, steps = update_to_last_fit(current, [step(name, parameters={name: value}) for name in "abc"])
    assert [s.adopted for s in steps] == [False, True, True]
    assert steps[0].refusal == Refusal(kind="superfluous")
    assert gone == ["a"]
    assert now is without, "the answer's errors and its model are those of the fit without it"


def test_a_joint_on_which_the_effect_of_a_step_may_be_absent_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    intervals = {"one": (0.0, 0.1), "two": (8.6, 9.4)}
    joints = {"one": (1,), "two": (2,)}
    known = {n: SimpleNamespace(name=n, null=0.0, low=0.0, effect="coulomb_friction", joints=joints[n]) for n in joints}
    current = cast(Any, SimpleNamespace(point=SimpleNamespace(model=SimpleNamespace(by_name=known))))
    gone = removed(monkeypatch, current)

    def values(_current: Any, own: list[Any], _shift: Any) -> dict[str, FoundValue]:
        return {
            p.name: FoundValue(value=sum(intervals[p.name]) / 2, low=low, high=high, unit="N·m")
            for p in own
            for low, high in (intervals[p.name],)
        }

    monkeypatch.setattr(last_fit, "shift_by_noise", lambda *_: 0.0)
    monkeypatch.setattr(last_fit, "found_values", values)
    both = step("coulomb_friction", (1, 2), parameters=values(None, list(known.values()), None))
    _, steps = update_to_last_fit(current, [both])
    assert (steps[0].adopted, steps[0].joints, list(steps[0].parameters), gone) == (True, (2,), ["two"], ["one"])
    intervals["two"] = (0.0, 0.1)
    assert update_to_last_fit(current, [both])[1][0].joints == (1, 2), "it is not left without any"


def test_the_parameters_of_a_step_are_those_of_the_last_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a step that is taken; one that is refused keeps its own."""
    name = "joint2.dead_zone.width"
    before, last = (
        FoundValue(value=value, low=low, high=high, unit="V")
        for value, low, high in ((0.747, 0.724, 0.77), (0.7475, 0.6732, 0.8217))
    )
    taken = step("dead_zone", (2,), parameters={name: before})
    refused = taken.model_copy(update={"adopted": False})
    known = {name: SimpleNamespace(name=name, null=0.0, low=0.0, joints=(2,))}
    current = cast(Any, SimpleNamespace(point=SimpleNamespace(model=SimpleNamespace(by_name=known))))
    monkeypatch.setattr(last_fit, "shift_by_noise", lambda *_: 0.0)
    monkeypatch.setattr(last_fit, "found_values", lambda _c, own, _m: {p.name: last for p in own})
    _, steps = update_to_last_fit(current, [taken, refused])
    assert steps[0].parameters == {name: last}
    assert steps[1] == refused


@pytest.mark.parametrize(("low", "nothing"), [(1e-7, True), (2e-3, False)])
def test_an_estimate_at_its_lower_bound_counts_as_absent(low: float, nothing: bool) -> None:
    """An inductance is never quite zero: its interval ends at the least that can be simulated."""
    inductance: Any = SimpleNamespace(name="inductance", null=0.0, low=1e-7)
    assert _is_nothing([(FoundValue(value=3e-3, low=low, high=9e-3, unit="H"), inductance)]) is nothing
