"""What becomes of the candidates of a turn, and of its step later on."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from daq.contracts.progress import Never, silent
from model.discrepancy.candidates.ranking import Ranking
from model.discrepancy.diagnosis import FoundValue, Step, Where
from model.discrepancy.grounds import Refusal
from model.discrepancy.output_error import diagnose, last_fit
from model.discrepancy.output_error.candidate_fit import Fit
from model.discrepancy.output_error.case import Case
from model.discrepancy.output_error.last_fit import _is_nothing, update_to_last_fit
from model.discrepancy.thresholds import Thresholds


def fit(name: str, evidence: float) -> Any:
    """A fitted candidate of that name on joint 1."""
    return SimpleNamespace(hypothesis=SimpleNamespace(name=name, joints=(1,)), evidence=evidence)


def turned(monkeypatch: pytest.MonkeyPatch, fits: list[Any], holding: str | None) -> Any:
    """What is found after one turn with these fits, of which held-out traces refuse all but one."""
    start, end = cast(Fit, object()), cast(Fit, object())

    def make_step(_case: Any, current: Fit, _ranking: Ranking, decision: Any) -> tuple[Any, Fit]:
        if decision.kind == "nothing":
            return None, current
        name = decision.best.hypothesis.name
        step = SimpleNamespace(effect=name, joints=(1,), evidence=1.0, adopted=name == holding, group=())
        return step, end if step.adopted else current

    monkeypatch.setattr(diagnose, "_rank", lambda *_: (Ranking(tuple(fits), ()), start))
    monkeypatch.setattr(diagnose, "make_step", make_step)
    case = cast(Any, SimpleNamespace(thresholds=Thresholds(significant=12.0)))
    found = diagnose._add_effect(case, diagnose._Search(start, start), silent, Never())
    assert len(found.before) == len(found.steps)
    assert found.current is (end if found.added else start)
    return found


def test_the_next_candidate_has_its_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    found = turned(monkeypatch, [fit("backlash", 90.0), fit("stiction", 40.0)], "stiction")
    assert [(s.effect, s.adopted) for s in found.steps] == [("backlash", False), ("stiction", True)]
    assert not found.ended
    assert found.tried is None, "something was added"


def test_what_is_not_significant_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    found = turned(monkeypatch, [fit("backlash", 90.0), fit("stiction", 8.0)], "stiction")
    assert [s.effect for s in found.steps] == ["backlash"]
    assert found.ended
    assert found.tried is not None
    assert [f.hypothesis.name for f in found.tried.fitted] == ["backlash", "stiction"], "also what was refused"


def test_the_chances_come_to_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    found = turned(monkeypatch, [fit(f"effect_{k}", 90.0 - 10 * k) for k in range(6)], None)
    assert len(found.steps) == diagnose.CHANCES
    assert found.ended


def test_what_a_later_effect_explains_is_taken_out_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both have come out with the same interval; only one of them has its null in it, and the newest stays anyway."""
    nowhere = Where(joint=None, phase=None, summary="", cells=(), dependences=())
    value = FoundValue(value=0.1, low=-0.1, high=0.3, unit="1")

    def step(effect: str) -> Step:
        return Step(
            effect=effect, joints=(1,), parameters={effect: value}, evidence=50.0, margin=50.0, candidates=(),
            rmse_fit=(), where=nowhere, reason="", adopted=True,
        )  # fmt: skip

    def parameter(name: str, null: float, low: float = -1.0) -> Any:
        return SimpleNamespace(name=name, null=null, low=low, effect=name, joints=(1,))

    known = {"a": parameter("a", 0.0), "b": parameter("b", 1.0), "c": parameter("c", 0.0)}
    current = cast(Any, SimpleNamespace(point=SimpleNamespace(model=SimpleNamespace(by_name=known))))
    without = cast(Any, SimpleNamespace(point=SimpleNamespace(model=SimpleNamespace(by_name=known))))
    gone: list[str] = []
    monkeypatch.setattr(last_fit, "_without", lambda _o, _p, names: gone.extend(names) or without)
    monkeypatch.setattr(last_fit, "shift_by_noise", lambda *_: 0.0)
    monkeypatch.setattr(last_fit, "found_values", lambda _c, own, _m: {p.name: value for p in own})
    now, steps = update_to_last_fit(current, [step("a"), step("b"), step("c")])
    assert [s.adopted for s in steps] == [False, True, True]
    assert steps[0].refusal == Refusal(kind="superfluous")
    assert gone == ["a"]
    assert now is without, "the answer's errors and its model are those of the fit without it"


def test_the_parameters_of_a_step_are_those_of_the_last_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a step that is taken; one that is refused keeps its own."""
    name = "joint2.dead_zone.width"
    turn, last = (
        FoundValue(value=value, low=low, high=high, unit="V")
        for value, low, high in ((0.747, 0.724, 0.77), (0.7475, 0.6732, 0.8217))
    )
    step = Step(
        effect="dead_zone", joints=(2,), parameters={name: turn}, evidence=50.0, margin=50.0, candidates=(),
        rmse_fit=(), where=Where(joint=2, phase=None, summary="", cells=(), dependences=()), reason="", adopted=True,
    )  # fmt: skip
    refused = step.model_copy(update={"adopted": False})
    known = {name: SimpleNamespace(name=name, null=0.0, low=0.0)}
    current = cast(Any, SimpleNamespace(point=SimpleNamespace(model=SimpleNamespace(by_name=known))))
    monkeypatch.setattr(last_fit, "shift_by_noise", lambda *_: 0.0)
    monkeypatch.setattr(last_fit, "found_values", lambda _c, own, _m: {p.name: last for p in own})
    _, steps = update_to_last_fit(current, [step, refused])
    assert steps[0].parameters == {name: last}
    assert steps[1] == refused


@pytest.mark.parametrize(("low", "nothing"), [(1e-7, True), (2e-3, False)])
def test_a_bound_that_keeps_an_estimate_from_nothing_does_not_make_it_something(low: float, nothing: bool) -> None:
    """An inductance is never quite zero: its interval ends at the least that can be simulated."""
    inductance: Any = SimpleNamespace(name="inductance", null=0.0, low=1e-7)
    assert _is_nothing([(FoundValue(value=3e-3, low=low, high=9e-3, unit="H"), inductance)]) is nothing


class Held:
    """Held-out traces on which the sum of squares rises so much, with that deviation."""

    def __init__(self, rise: float, deviation: float) -> None:
        self.observation = SimpleNamespace(samples=30)
        self.risen = rise, deviation

    def rise(self, *_: Any) -> tuple[float, float]:
        return self.risen


@pytest.mark.parametrize(
    ("evidence", "rise", "deviation", "refused"),
    [
        (60.0, 13.0, 7.0, False),
        (60.0, 15.0, 7.0, True),
        (60.0, 9.0, 2.0, False),
        (60.0, 11.0, 2.0, True),
        (12.0, 4.0, 5.0, False),
        (12.0, 6.0, 5.0, True),
        (7.0, -2.0, 5.0, False),
        (7.0, 6.0, 5.0, True),
    ],
)
def test_held_out_traces_refuse_what_makes_them_worse(
    evidence: float, rise: float, deviation: float, refused: bool
) -> None:
    """By two deviations and what is significant, or by one where little more than that was; never what makes them
    better."""
    fields = dict.fromkeys(Case.__dataclass_fields__)
    fields |= {
        "held": Held(rise, deviation),
        "scoring": SimpleNamespace(samples=100),
        "thresholds": Thresholds(significant=10.0),
    }
    case = Case(**cast(Any, fields))
    found = SimpleNamespace(evidence=evidence, fit=SimpleNamespace(point=20.0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Case, "_square", lambda _self, point: point)  # a fall of 5: half a third of it counts for nothing
        assert (case.refused(cast(Any, found), cast(Any, 25.0), ((), ()), ()) is not None) == refused
