"""What becomes of the candidates of a turn, and of its step later on."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from daq.contracts.progress import Never, silent
from model.discrepancy import workflow
from model.discrepancy.answer import FoundValue, Step, Where
from model.discrepancy.ranking import Ranking
from model.discrepancy.refitting import Judged
from model.discrepancy.thresholds import Thresholds


def fit(name: str, evidence: float) -> Any:
    """A fitted candidate of that name on joint 1."""
    return SimpleNamespace(candidate=SimpleNamespace(name=name, joints=(1,)), evidence=evidence)


def turned(monkeypatch: pytest.MonkeyPatch, fits: list[Any], holding: str | None) -> Any:
    """What is found after one turn with these fits, of which held-out traces refuse all but one."""
    start, end = cast(Judged, object()), cast(Judged, object())

    def step_of(_case: Any, current: Judged, _ranking: Ranking, decision: Any) -> tuple[Any, Judged]:
        if decision.kind == "nothing":
            return None, current
        name = decision.best.candidate.name
        step = SimpleNamespace(effect=name, joints=(1,), evidence=1.0, adopted=name == holding, group=())
        return step, end if step.adopted else current

    monkeypatch.setattr(workflow, "_ranked", lambda *_: (Ranking(tuple(fits), ()), start))
    monkeypatch.setattr(workflow, "step_of", step_of)
    case = cast(Any, SimpleNamespace(thresholds=Thresholds(significant=12.0)))
    found = workflow._after_turn(case, workflow._Found(start, start), silent, Never())
    assert len(found.before) == len(found.steps)
    assert found.current is (end if found.added else start)
    return found


def test_the_next_candidate_has_its_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    found = turned(monkeypatch, [fit("backlash", 90.0), fit("stiction", 40.0)], "stiction")
    assert [(s.effect, s.adopted) for s in found.steps] == [("backlash", False), ("stiction", True)]
    assert not found.ended


def test_what_is_not_significant_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    found = turned(monkeypatch, [fit("backlash", 90.0), fit("stiction", 8.0)], "stiction")
    assert [s.effect for s in found.steps] == ["backlash"]
    assert found.ended


def test_the_chances_come_to_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    found = turned(monkeypatch, [fit(f"effect_{k}", 90.0 - 10 * k) for k in range(6)], None)
    assert len(found.steps) == workflow.CHANCES
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

    known = {"a": SimpleNamespace(name="a", null=0.0), "b": SimpleNamespace(name="b", null=1.0)}
    known["c"] = SimpleNamespace(name="c", null=0.0)
    current = cast(Any, SimpleNamespace(point=SimpleNamespace(model=SimpleNamespace(by_name=known))))
    monkeypatch.setattr(workflow, "found_values", lambda _o, _c, own: {p.name: value for p in own})
    found = workflow._Found(current, current, steps=(step("a"), step("b"), step("c")))
    last = workflow._as_last_fitted(cast(Any, None), found)
    assert [s.adopted for s in last.steps] == [False, True, True]
    assert last.steps[0].rejected_because == "superfluous once a later effect was in"
