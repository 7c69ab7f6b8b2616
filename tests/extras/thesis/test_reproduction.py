"""The whole reproduction on the ramp that the command records, of a plant with complete friction, and chapter 8."""

import math
import re
import threading
from itertools import pairwise
from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from daq.contracts.progress import CancelledError
from daq.contracts.trace import Trace
from extras.thesis.control_cases import ControlChapter, control_chapter, lags
from extras.thesis.ladder import Ladder
from extras.thesis.reproduction import Reproduction, reproduce_thesis
from extras.thesis.text import as_text


@pytest.fixture(scope="module")
def ladder(result: Reproduction) -> Ladder:
    return result.ladders[0]


def test_every_step_of_the_ladder_fits_better_and_explains_more(ladder: Ladder) -> None:
    errors = [s.error for s in ladder.steps]
    sums = [s.fidelity.sum_of_contributions for s in ladder.steps]
    assert errors == sorted(errors, reverse=True)
    assert sums == sorted(sums)
    assert ladder.unoptimised_error > errors[0]


def test_back_emf_of_joint_2_stands_in_for_friction_until_there_is_some(ladder: Ladder) -> None:
    _, with_back_emf, viscous, complete = ladder.steps
    assert with_back_emf.values["Kb2"] > 0.06
    assert viscous.values["Kb2"] == pytest.approx(0.0334, rel=0.2)
    assert complete.values["Kb2"] == pytest.approx(0.0334, rel=0.2)
    assert complete.values["v_eff2"] == pytest.approx(2.53e-4, rel=0.25)


def test_the_waist_s_link_is_insensitive_throughout(ladder: Ladder) -> None:
    for step in ladder.steps:
        for name in ("link1.mass", "link1.radius"):
            assert step.fidelity.parameter(name).contribution < 0.01 * step.fidelity.sum_of_contributions


def test_only_the_known_statements_do_not_come_out(result: Reproduction) -> None:
    assert {c.name for c in result.failed} == {
        "table 5.1, joint 1",
        "table 5.2, joint 1",
        "with the tabled back-EMF constants cases 1 and 2 are damped",
        "PID from 90°: joint 3 overshoots",
    }


def test_a_reproduction_without_traces_or_methods_is_refused() -> None:
    with pytest.raises(SpecError, match="at least one trace"):
        reproduce_thesis([])


def test_elements_of_the_inertia_matrix_are_those_of_the_equation_that_figure_7_12_names(result: Reproduction) -> None:
    """(7.28) takes link 3 and its load as one rod: D23 is 0.109 to 0.114 kg·m² there, and 0.101 to 0.105 exactly."""
    coupling = result.figures.analysis.element(2, 3).whole
    assert (min(coupling), max(coupling)) == pytest.approx((0.109, 0.114), abs=6e-4)


# ---- chapter 8, as far as it can be reproduced


@pytest.fixture(scope="module")
def chapter() -> ControlChapter:
    return control_chapter()


def test_better_models_follow_better(chapter: ControlChapter) -> None:
    names = ("case 1: basic", "case 2: viscous", "case 3: complete")
    cases = [chapter.case(f"{n}, back-EMF of the plant") for n in names]
    assert max(cases[0].first_amplitude_ratio) < 0.8
    for worse, better in pairwise(cases):
        assert all(b < w for w, b in zip(worse.rms, better.rms, strict=True))
    assert cases[2].amplitude_ratio == pytest.approx((1, 1, 1), abs=0.01)


def test_the_tabled_back_emf_of_the_basic_model_is_too_much_for_the_plant(chapter: ControlChapter) -> None:
    assert chapter.case("case 1: basic, back-EMF as tabled").amplitude_ratio[0] > 1.5


def test_in_the_last_case_both_readings_of_the_law_give_the_same(chapter: ControlChapter) -> None:
    one, other = (chapter.case(f"case 3: complete, back-EMF {w}") for w in ("as tabled", "of the plant"))
    assert one.position == other.position


def test_pid_follows_and_overshoots_from_another_posture(chapter: ControlChapter) -> None:
    pid, other = chapter.case("PID"), chapter.case("PID from 90°")
    assert min(pid.amplitude_ratio) > 0.9
    assert max(math.degrees(r) for r in pid.rms) < 3
    assert pid.overshoot[1] < math.radians(0.5)
    assert other.overshoot[1] > math.radians(2)


def test_pid_lags_on_every_joint(chapter: ControlChapter) -> None:
    """Seen from the other side, as if the wanted motion followed the position, it leads by as much."""
    pid = chapter.case("PID")
    assert min(lags(pid)) > math.radians(0.5)
    assert max(lags(pid)) < math.radians(10)
    leading = pid.model_copy(update={"wanted": pid.position, "position": pid.wanted})
    assert lags(leading) == pytest.approx([-lag for lag in lags(pid)])
    assert "lag" in next(c.ours for c in chapter.checks if c.name == "PID follows with a lag")


def test_the_chapter_can_be_cancelled() -> None:
    now = threading.Event()
    now.set()
    with pytest.raises(CancelledError):
        control_chapter(cancel=now)


# ---- docs/thesis.md shows what `daq thesis` prints: every line of its blocks, in their order


PAGE = Path(__file__).parents[3] / "docs" / "thesis.md"
SLOW = "nelder_mead"
RELATIVE, ABSOLUTE = 0.02, 1e-7
"""How far a number may lie from the command's: where another processor rounds otherwise, a fit goes on from that."""
NUMBER = re.compile(r"[-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def blocks() -> list[list[str]]:
    """The page's blocks of output, lines that stand for others left out."""
    found = re.findall(r"```text\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    return [[line for line in block.splitlines() if line.strip() not in ("", "...")] for block in found]


def test_the_page_shows_what_the_command_prints(result: Reproduction) -> None:
    quick = [block for block in blocks() if not any(SLOW in line for line in block)]
    assert len(quick) >= 5
    for block in quick:
        compare(block, as_text(result).splitlines())


@pytest.mark.slow
def test_the_page_shows_what_the_command_prints_hill_climbing_included(ramp: Trace) -> None:
    whole = as_text(reproduce_thesis([ramp])).splitlines()
    for block in blocks():
        compare(block, whole)


def compare(block: list[str], output: list[str]) -> None:
    """Fails with the first line of the block that the rest of the output has not."""
    at = 0
    for line in block:
        found = next((k for k in range(at, len(output)) if alike(line, output[k])), None)
        assert found is not None, f"docs/thesis.md has a line that `daq thesis` does not print: {line}"
        at = found + 1


def alike(one: str, other: str) -> bool:
    """The same words, and numbers that are as good as equal; numbers of traces are left aside."""
    first, second = (re.sub(r"\b[0-9a-f]{12}\b", "TRACE", " ".join(line.split())) for line in (one, other))
    if NUMBER.sub("#", first) != NUMBER.sub("#", second):
        return False
    numbers = [[float(n.replace("−", "-")) for n in NUMBER.findall(line)] for line in (first, second)]
    return numbers[0] == pytest.approx(numbers[1], rel=RELATIVE, abs=ABSOLUTE)
