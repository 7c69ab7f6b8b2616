"""Held-out traces are fitted to in turn: they may show what the others do not, and confirm or exclude what these do."""

from collections.abc import Collection
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from daq.traces.csv_table import import_csv
from model.discrepancy.diagnosis import Candidate, Diagnosis, FoundValue, SignalError, Step, Suspicion, Verdict
from model.discrepancy.explanation.answer_words import method_words
from model.discrepancy.grounds import Refusal, RefusalKind
from model.discrepancy.inverse_dynamics import both_ways, looks
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics.rigs import slide_machine
from tests.model.discrepancy.steps import answer_of, step
from trials.rigs.folder import write_world

MODEL = base_model(slide_machine())
LITTLE, PLENTY = 0.3 * both_ways.PLAIN, 3.0 * both_ways.PLAIN


def answer(*steps: Step, verdict: Verdict | None = None) -> Diagnosis:
    """An answer that has adopted these steps."""
    return answer_of(MODEL, *steps, verdict=verdict)


def named(
    *effects: str, evidence: float = LITTLE, held_out: float = both_ways.CONFIRMED, joints: tuple[int, ...] = (1,)
) -> Step:
    """A step that names an effect, or a group of them; `held_out` of its evidence is of held-out traces."""
    members = tuple(Candidate(effect=name, joints=joints, evidence=40.0) for name in effects)
    parts = {"evidence": evidence - held_out, "evidence_held_out": held_out}
    return step(effects[0], joints, **parts, group=members if len(members) > 1 else ())


class Look:
    """A look that withdraws steps without fitting anything."""

    def __init__(self, said: Diagnosis, spoken_for: tuple[str, ...] = (), left: Verdict | None = None) -> None:
        self.answer, self.spoken_for, self.left = said, spoken_for, left

    def speaks_for(self, step: Step) -> bool:
        return step.effect in self.spoken_for

    def withdraw(self, steps: Collection[Step]) -> Diagnosis:
        return answer(*(s for s in self.answer.steps if not any(s is one for one in steps)), verdict=self.left)


def leaves(noises: float) -> SignalError:
    """The error of a joint that is so many times its noise."""
    return SignalError(joint=1, before=20.0, after=noises, floor=1.0, unit="N")


def joined(
    first: Diagnosis, other: Diagnosis, spoken_for: tuple[str, ...] = (), left: Verdict | None = None
) -> tuple[list[tuple[str | None, list[str]]], Verdict, list[str]]:
    """Names with their groups, verdict and kinds of notes of the answer of both.

    Args:
        spoken_for: effects for which the others speak, though their motion does not let them be named.
        left: the others' verdict once effects are withdrawn from them; by default that of the effects that stay.
    """
    look: Any = Look(first)
    exchanged: Any = Look(other, spoken_for, left)
    found = both_ways._join(look, exchanged)
    names = [(s.effect, [m.effect for m in s.group]) for s in found.steps]
    return names, found.verdict, [note.kind for note in found.notes_data]


def test_what_held_out_traces_alone_show_is_said_with_a_note() -> None:
    found = joined(answer(), answer(named("backlash", evidence=PLENTY)))
    assert found == ([("backlash", [])], "named", ["traces-exchanged"])
    assert joined(answer(), answer(named("backlash", evidence=LITTLE))) == ([], "nothing-significant", [])
    unknown = answer(verdict="unknown-effect")
    assert joined(answer(), unknown) == ([], "unknown-effect", ["traces-exchanged"])
    suspected = answer(verdict="suspected")
    assert joined(answer(), suspected) == ([], "nothing-significant", [])


def test_what_held_out_traces_show_beside_a_plain_effect_is_not_said() -> None:
    both = answer(named("backlash", evidence=PLENTY), named("joint_compliance", evidence=LITTLE))
    assert joined(answer(), both) == ([("backlash", [])], "named", ["traces-exchanged"])
    little = answer(named("spring_torque", evidence=LITTLE))
    assert joined(little, both) == ([("backlash", [])], "named", ["traces-exchanged"])


def test_a_weak_name_in_held_out_traces_does_not_hide_that_something_is_left_there() -> None:
    """Which of the traces was given first makes no difference then."""
    weak = answer(named("gear_loss", evidence=12.0))
    assert joined(answer(), weak, left="unknown-effect") == ([], "unknown-effect", ["traces-exchanged"])
    assert joined(answer(), weak) == ([], "nothing-significant", [])


@pytest.mark.parametrize(
    ("evidence", "held_out", "left"),
    [
        pytest.param(LITTLE, 20.0, [], id="little"),
        pytest.param(PLENTY, 20.0, [("spring_torque", [])], id="plain"),
        pytest.param(PLENTY, 0.0, [], id="plain in the fitted traces alone"),
    ],
)
def test_one_effect_that_the_others_do_not_show_is_named_where_it_is_plain(
    evidence: float, held_out: float, left: list[tuple[str, list[str]]]
) -> None:
    found = joined(answer(named("spring_torque", evidence=evidence, held_out=held_out)), answer())
    assert found == (left, "named" if left else "nothing-significant", [])


def test_little_evidence_gives_way_to_what_the_others_show_plainly() -> None:
    little = answer(named("spring_torque", evidence=LITTLE))
    assert joined(little, answer(named("backlash", evidence=LITTLE))) == ([], "nothing-significant", [])
    found = joined(little, answer(named("backlash", evidence=PLENTY)))
    assert found == ([("backlash", [])], "named", ["traces-exchanged"])


def test_what_the_others_suspect_is_confirmed() -> None:
    doubt = Suspicion(effect="spring_torque", joints=(1,), evidence=28.0, needed=30.0, seconds=5.0)
    other = answer(verdict="suspected").model_copy(update={"suspicion": doubt})
    assert joined(answer(named("spring_torque")), other) == ([("spring_torque", [])], "named", [])


def test_of_several_effects_those_that_the_others_show_are_named() -> None:
    both = answer(named("gear_loss", evidence=PLENTY), named("stribeck_friction", evidence=PLENTY))
    assert joined(both, answer(named("gear_loss"))) == ([("gear_loss", [])], "named", [])
    elsewhere = answer(named("gear_loss"), named("stribeck_friction", joints=(2,)))
    assert joined(both, elsewhere)[0] == [("gear_loss", [])]
    assert joined(both, both)[0] == [("gear_loss", []), ("stribeck_friction", [])]
    relative = answer(named("gear_loss"), named("coulomb_friction"))  # another law of dry friction confirms one
    assert joined(both, relative)[0] == [("gear_loss", []), ("stribeck_friction", [])]
    apart = answer(named("gear_loss", evidence=PLENTY), named("backlash", evidence=PLENTY, joints=(2,)))
    assert joined(apart, answer(named("gear_loss")))[0] == [("gear_loss", []), ("backlash", [])]


def test_a_group_keeps_the_names_that_both_leave() -> None:
    group = answer(named("potentiometer_gain", "potentiometer_nonlinearity", "spring_torque", evidence=PLENTY))
    alone = answer(named("potentiometer_gain"))
    assert joined(group, alone) == ([("potentiometer_gain", [])], "named", ["names-excluded"])
    fewer = answer(named("spring_torque", "potentiometer_gain"))
    expected = ([("potentiometer_gain", ["potentiometer_gain", "spring_torque"])], "ambiguous", ["names-excluded"])
    assert joined(group, fewer) == expected
    other_first = answer(named("spring_torque"))  # it excludes the effect that the model was given
    whole = [(s.effect, [m.effect for m in s.group]) for s in group.steps]
    assert joined(group, other_first) == (whole, "ambiguous", [])


@pytest.mark.parametrize("again", [True, False])
def test_a_suspicion_stays_where_the_others_have_one_too(again: bool) -> None:
    doubt = Suspicion(effect="spring_torque", joints=(1,), evidence=19.0, needed=30.0, seconds=10.0)
    first = answer(verdict="suspected").model_copy(update={"suspicion": doubt})
    found = joined(first, first if again else answer())
    assert found == (([], "suspected", []) if again else ([], "nothing-significant", ["suspicion-dropped"]))


@pytest.mark.parametrize(
    ("with_effect", "without", "contradicted"),
    [
        pytest.param(8.0, 9.0, True, id="the effect does not explain the others either"),
        pytest.param(1.2, 9.0, False, id="with the effect, the others are explained"),
        pytest.param(8.0, 1.1, False, id="the others leave something on another joint"),
    ],
)
def test_what_the_others_contradict_has_no_name(with_effect: float, without: float, contradicted: bool) -> None:
    first = answer(named("viscous_friction", evidence=PLENTY)).model_copy(
        update={"rmse_holdout": (leaves(with_effect),)}
    )
    unknown = answer(verdict="unknown-effect").model_copy(update={"rmse_fit": (leaves(without),)})
    found = joined(first, unknown)
    name = ([("viscous_friction", [])], "named", [])
    assert found == (([], "unknown-effect", ["traces-contradict"]) if contradicted else name)
    assert joined(first, unknown, ("viscous_friction",)) == name, "too little moves for it to be named"


def test_what_the_others_speak_for_without_naming_it_is_confirmed() -> None:
    """A ripple of which a record shows half a wave."""
    little = answer(named("torque_ripple"))
    assert joined(little, answer()) == ([], "nothing-significant", [])
    assert joined(little, answer(), ("torque_ripple",)) == ([("torque_ripple", [])], "named", [])


def diagnosed(folder: Path, kind: str, seed: int, case: str) -> Diagnosis:
    """The answer for a rig of another world."""
    write_world(folder, kind, seed, case)
    lab = folder / "lab"
    training, held_out = (import_csv(lab / f"{name}.csv") for name in ("training", "held_out"))
    return diagnose_torques(base_model(load_machine(str(lab / "machine.toml"))), [training], [held_out])


def test_a_scale_that_small_steps_do_not_show_is_found_in_a_sweep_that_was_held_out(tmp_path: Path) -> None:
    """Over 15° a wrong scale is a heavier arm; over 90° it is not."""
    found = diagnosed(tmp_path, "axis-current-steps", 142537758738129, "single")
    (adopted,) = [s for s in found.steps if s.adopted]
    assert (adopted.effect, adopted.joints) == ("potentiometer_gain", (1,)), found.summary
    assert adopted.parameters["joint1.potentiometer_gain.relative"].value == pytest.approx(0.0702, abs=0.005)
    assert method_words(found).endswith("in the traces that were held out; the others were held out in turn")
    assert found.robot_seconds == pytest.approx(8.4, abs=0.1), "the held-out record was fitted to"
    assert found.notes[0].startswith("The traces that were given to be fitted to show nothing plain that has a name")
    assert found.rmse_holdout[0].after < 0.6 * found.rmse_holdout[0].before


@pytest.mark.slow
def test_a_ripple_of_which_the_others_show_less_than_a_wave_keeps_its_name(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, "planar-current-via", 8874690243275, "single")
    assert [(s.effect, s.joints) for s in found.steps if s.adopted] == [("torque_ripple", (2,))], found.summary


@pytest.mark.slow
def test_a_drag_that_looks_viscous_in_one_motion_is_contradicted_by_another(tmp_path: Path) -> None:
    """Quadratic drag, which the library has no law for."""
    found = diagnosed(tmp_path, "axis-current-steps", 278342827514058, "open")
    assert found.verdict == "unknown-effect", found.summary
    assert not [s for s in found.steps if s.adopted]
    assert "viscous friction on joint 1 would explain" in found.notes[0].lower()


@pytest.mark.slow
def test_friction_that_only_one_record_shows_beside_a_loss_is_taken_back(tmp_path: Path) -> None:
    """What a loss leaves where motion turns looks like Stribeck friction in steps, and not in a slow ramp."""
    found = diagnosed(tmp_path, "axis-current-steps", 54738089683743, "single")
    assert found.verdict == "named"
    assert [s.effect for s in found.steps if s.adopted] == ["gear_loss"], found.summary
    (refused,) = [s for s in found.steps if s.refusal is not None and s.refusal.kind == "found-one-way"]
    assert refused.effect == "stribeck_friction"
    assert refused.rejected_because == "a search in the held-out traces, which are fitted to in turn, does not find it"
    assert "stribeck_friction" not in {use.name for use in found.model_after.effects}
    assert [stage.effect for stage in found.gap.stages if stage.effect] == ["gear_loss"] if found.gap else False


@pytest.mark.parametrize(
    ("every", "kept", "turned"),
    [
        pytest.param(25, 1.0, True, id="the traces to fit to are too slow for the cutoff of the others"),
        pytest.param(1, 0.12, False, id="the others are too short"),
    ],
)
def test_traces_that_cannot_be_fitted_to_are_a_check_alone(
    every: int, kept: float, turned: bool, tmp_path: Path
) -> None:
    write_world(tmp_path, "axis-current-steps", 54738089683743, "single")
    lab = tmp_path / "lab"
    names, *rows = (lab / "training.csv").read_text("utf-8").splitlines()
    (lab / "part.csv").write_text("\n".join([names, *rows[: round(kept * len(rows)) : every]]) + "\n", "utf-8")
    traces = [import_csv(lab / f"{name}.csv") for name in (("part", "held_out") if turned else ("held_out", "part"))]
    found = diagnose_torques(base_model(load_machine(str(lab / "machine.toml"))), traces[:1], traces[1:])
    assert found.traces == (traces[0].record.trace_id,)
    assert any(note.kind == "not-exchanged" for note in found.notes_data), found.verdict


class _Candidate:
    """A fitted effect of which a record's motion shows too little."""

    def __init__(self, effect: str, joints: tuple[int, ...], frequency: float) -> None:
        self.effect, self.joints = effect, joints
        self.parameters = (SimpleNamespace(name="rate", part="frequency"),)
        self.fit = SimpleNamespace(values={"rate": frequency})


@pytest.mark.parametrize(
    ("effect", "joints", "frequency", "speaks"),
    [
        pytest.param("torque_ripple", (1,), 0.0, False, id="another effect"),
        pytest.param("periodic_disturbance", (2,), 1.5, False, id="another joint"),
        pytest.param("periodic_disturbance", (1,), 1.55, True, id="as often"),
        pytest.param("periodic_disturbance", (1,), 0.4, False, id="less often"),
    ],
)
def test_records_speak_for_a_disturbance_that_repeats_as_often(
    effect: str, joints: tuple[int, ...], frequency: float, speaks: bool
) -> None:
    records: Any = SimpleNamespace(traces=(SimpleNamespace(time=np.array([0.0, 8.0])),), held_out=())
    beyond = (_Candidate(effect, joints, frequency),)
    workflow: Any = SimpleNamespace(beyond_motion=beyond, found=SimpleNamespace(steps=()))
    rate = FoundValue(value=1.5, low=1.4, high=1.6, unit="Hz", part="frequency", joints=(1,))
    found = step("periodic_disturbance", parameters={"joint1.periodic_disturbance.frequency": rate})
    assert looks.Look(workflow, records, 12.0).speaks_for(found) == speaks


@pytest.mark.parametrize(
    ("kind", "joints", "speaks"),
    [("leaves-more-than-noise", (1,), True), ("leaves-more-than-noise", (2,), False), ("superfluous", (1,), False)],
)
def test_records_that_leave_more_beside_an_effect_speak_for_it(
    kind: RefusalKind, joints: tuple[int, ...], speaks: bool
) -> None:
    refused = step("coulomb_friction", joints).model_copy(update={"adopted": False, "refusal": Refusal(kind=kind)})
    workflow: Any = SimpleNamespace(beyond_motion=(), found=SimpleNamespace(steps=(refused,)))
    records: Any = SimpleNamespace(traces=(), held_out=())
    assert looks.Look(workflow, records, 12.0).speaks_for(named("coulomb_friction")) is speaks
