"""Free motions: drawn and changed at random within the machine's limits, and written as experiments that can be run."""

import json
from itertools import pairwise

import numpy as np
import pytest

from daq.contracts.errors import SafetyError
from daq.contracts.experiment import ExperimentSpec, parse_spec
from daq.contracts.machine import Machine, load_machine
from daq.safety.planned import planned
from model.discrepancy.experiment_design.drawn_motions import Drawer
from model.discrepancy.experiment_design.motions import (
    Block,
    Motion,
    can_be_designed,
    spec_of,
    within_limits,
    words_of_motion,
)

MA2000 = load_machine("ma2000")
LONGEST = 20.0
PERIOD = 0.02


def drawer(seed: int) -> Drawer:
    return Drawer(np.random.default_rng(seed), MA2000, LONGEST)


def some_motions(seed: int) -> list[Motion]:
    """The first ones, twenty that are drawn, and twenty changed twice."""
    draw = drawer(seed)
    found = [*draw.first(), *(draw.drawn() for _ in range(20))]
    changed = [draw.changed(motion, found) for motion in found[-20:]]
    return [*found, *changed, *(draw.changed(motion, changed) for motion in changed)]


def test_the_same_generator_gives_the_same_experiments() -> None:
    one, two, other = ([spec_of(m, MA2000, "m") for m in some_motions(seed)] for seed in (3, 3, 4))
    assert one == two
    assert one != other


def test_motions_keep_range_speed_and_step_of_every_joint() -> None:
    reached, why = 0, []
    for motion in some_motions(1):
        try:
            angles = planned(spec_of(motion, MA2000, "m"), MA2000)
        except SafetyError as refused:
            why.append(str(refused))
            continue
        reached += 1
        assert len(angles) * PERIOD < LONGEST + 0.5
        jumps = any(block.way == "step" for block in motion.blocks)
        for joint in MA2000.modelled_joints:
            own, column = MA2000.limits.joint(joint), angles[:, joint - 1]
            assert own.low <= column.min()
            assert column.max() <= own.high
            if not jumps:
                assert np.abs(np.diff(column)).max() <= own.speed * PERIOD
    assert reached > 40
    assert all("height of" in text for text in why)  # the floor: what a joint's own limits do not say


def test_a_motion_goes_there_visits_its_levels_and_comes_back() -> None:
    levels = np.array([[1.0, -1.0, 0.5], [-1.0, 1.0, 0.0]])
    size = np.radians([10.0, 5.0, 4.0])
    block = Block("ramp", size, 1.0, 0.5, levels)
    motion = Motion(np.radians([30.0, 10.0, -20.0]), np.array([0, 1, 0]), (block,))
    spec = spec_of(motion, MA2000, "there-and-back")
    assert spec.gains == {2: (3, 0, 0)}
    angles = planned(spec, MA2000)[:, :3]
    start = angles[0]
    assert np.abs(angles[-1] - start).max() < 1e-9
    seen = angles - (start + motion.posture)
    for level in (*levels, np.zeros(3)):
        assert np.abs(seen - level * size).max(axis=1).min() < 1e-9
    assert len(angles) * PERIOD == pytest.approx(motion.time_around + block.duration, abs=5 * PERIOD)


def test_amplitudes_shrink_to_the_limits() -> None:
    far = Motion(
        np.zeros(3), np.zeros(3, dtype=np.int64), (Block("smooth", np.full(3, 9.0), 4.0, 0.0, np.ones((2, 3))),)
    )
    (block,) = within_limits(far, MA2000).blocks
    assert (block.amplitude < 2.3).all()
    planned(spec_of(within_limits(Motion(far.posture, far.change, (block,)), MA2000), MA2000, "m"), MA2000)


def test_an_experiment_reads_back_from_the_file_that_is_written() -> None:
    for motion in some_motions(2)[:8]:
        spec = spec_of(motion, MA2000, "designed-2-0")
        assert parse_spec(json.loads(spec.model_dump_json())) == spec
        assert isinstance(spec, ExperimentSpec)


def test_words_say_what_moves_how_often_and_with_which_gains() -> None:
    block = Block("step", np.radians([2.0, 0.0, 1.5]), 0.08, 0.0, np.ones((40, 3)))
    motion = Motion(np.radians([0.0, 20.0, 0.0]), np.array([1, 0, 0]), (block,))
    assert words_of_motion(motion, MA2000) == (
        "a motion designed for these candidates, 40 steps, one every 0.08 s (up to 2° on joint 1, 1.5° on joint 3), "
        "0°, 20°, 0° from the rest posture, with P = 3 on joint 1"
    )


def _without(**changes: object) -> Machine:
    return MA2000.model_copy(update=changes)


def test_motions_are_designed_only_where_limits_and_rest_posture_are_known() -> None:
    assert can_be_designed(MA2000)
    assert not can_be_designed(_without(rest_posture=None))
    unlimited = MA2000.limits.model_copy(update={"joints": MA2000.limits.joints[:2]})
    assert not can_be_designed(_without(limits=unlimited))


def test_changes_reach_every_part_of_a_motion() -> None:
    draw, motion = drawer(5), drawer(5).first()[0]
    seen = [motion]
    for _ in range(60):
        seen.append(draw.changed(seen[-1], [motion]))
    for part in ("posture", "change"):
        assert any(not np.array_equal(getattr(a, part), getattr(b, part)) for a, b in pairwise(seen))
    for part in ("pace", "amplitude", "levels"):
        assert any(
            not np.array_equal(getattr(a.blocks[0], part), getattr(b.blocks[0], part)) for a, b in pairwise(seen)
        )
