"""What the world's side says of which laws a record can tell apart."""

import pytest

from trials.rigs.drawing import sound_rig
from trials.rigs.hiding import OTHER_NAMES, find_drawn_law, hide, known
from trials.rigs.kinds import KINDS
from trials.rigs.rig import Rig
from trials.rigs.sharpness import detectability, sharpness


@pytest.fixture(scope="module")
def sound() -> Rig:
    return sound_rig("axis-current", KINDS["axis-current"], 1)


def test_a_sound_arm_has_no_rivals(sound: Rig) -> None:
    assert sharpness(sound) == []
    assert detectability(sound) == []


@pytest.mark.parametrize(("size", "is_seen"), [pytest.param(0.2, True, marks=pytest.mark.slow), (1e-5, False)])
def test_an_effect_of_some_size_is_seen_and_one_of_hardly_any_is_not(sound: Rig, size: float, is_seen: bool) -> None:
    rig = hide(sound, "coulomb_friction", 1, 0, {"coulomb": size * sound.strongest[0]})
    none, own = sharpness(rig, ())
    assert (none.name, own.name, own.d_prime) == ("none", "own", 0.0)
    assert (none.d_prime > 20.0) == is_seen


@pytest.mark.parametrize(("ratio", "is_seen"), [(1.5, False), (6.0, True)])
def test_friction_that_a_file_may_be_wrong_about_is_not_seen(sound: Rig, ratio: float, is_seen: bool) -> None:
    """The file states it to 30 %: a sound arm has up to three times of it."""
    (stated,) = (t.factor for t in sound.tolerances if t.name == "coulomb")
    own = float(sound.joints["coulomb"][0])
    rig = hide(sound, "coulomb_friction", 1, 0, {"coulomb": (ratio * stated - 1.0) * own})
    assert (sharpness(rig, ())[0].d_prime > 20.0) == is_seen


@pytest.mark.slow
def test_a_shifted_centre_and_a_heavier_link_are_nearly_one_to_an_axis(sound: Rig) -> None:
    rig = hide(sound, "centre_of_mass", 1, 0, {"shift": 0.2 * sound.bodies.links[0].a})
    none, _, mass, friction = sharpness(rig, ("link_mass", "viscous_friction"))
    assert none.d_prime > 20.0
    assert mass.d_prime < 0.01 * friction.d_prime  # gravity's torque is the same, inertia is not quite
    assert friction.d_prime <= none.d_prime


@pytest.mark.slow
def test_of_two_effects_each_is_looked_for_beside_the_other(sound: Rig) -> None:
    large = hide(sound, "coulomb_friction", 1, 0, {"coulomb": 0.2 * sound.strongest[0]})
    rig = hide(large, "viscous_friction", 1, 0, {"viscous": 1e-6})
    first, second = detectability(rig)
    assert first > 20.0
    assert second < 5.0


@pytest.mark.parametrize("name", OTHER_NAMES)
def test_a_name_of_the_library_is_drawn_by_a_law_that_has_this_name(name: str) -> None:
    for law in OTHER_NAMES[name]:
        library = known(name, law)[0]
        drawn, first = find_drawn_law(library)
        assert drawn == name
        assert known(drawn, first)[0] == library
