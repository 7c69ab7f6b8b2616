"""Numbers of the machine file after a fit, beside what the file states."""

from daq.contracts.machine import load_machine
from model.discrepancy.diagnosis import Diagnosis, FoundValue
from model.discrepancy.explanation.fitted_numbers import most_moved, stated_beside, stated_numbers
from model.machine_model.model import Model, base_model
from tests.model.discrepancy.steps import answer_of

GIVEN = base_model(load_machine("examples/pan_tilt.toml"))
MASS = "link1.mass"


def answer(after: Model, **fields: object) -> Diagnosis:
    return answer_of(GIVEN, model_after=after).model_copy(update=fields)


def moved(**deviations: float) -> Model:
    """The model with numbers so many stated deviations off; dots in names are written as double underscores."""
    values = {}
    for word, distance in deviations.items():
        p = GIVEN.parameter(word.replace("__", "."))
        values[p.name] = p.value + distance * p.deviation
    return GIVEN.with_values(values)


def test_numbers_are_listed_where_one_has_left_its_deviation_the_furthest_first() -> None:
    assert most_moved(answer(GIVEN)) == ()
    assert most_moved(answer(moved(link1__mass=0.9, link2__mass=-0.5))) == ()
    found = most_moved(answer(moved(link1__mass=0.4, link2__mass=1.5)))
    assert [n.name for n in found] == ["link2.mass", "link1.mass"]
    assert [round(n.distance, 6) for n in found] == [1.5, 0.4]
    assert found[0].stated == GIVEN.parameter("link2.mass").value


def test_no_more_than_five_are_listed_and_friction_of_the_file_is_among_them() -> None:
    named = [p.name for p in GIVEN.parameters if p.deviation and p.high > p.value + 3 * p.deviation]
    friction = next(name for name in named if "friction" in name)
    others = [name for name in named if name != friction][:6]
    far = moved(
        **{name.replace(".", "__"): 1.0 + k / 10 for k, name in enumerate(others)}, **{friction.replace(".", "__"): 2.5}
    )
    found = most_moved(answer(far))
    assert len(found) == 5
    assert found[0].name == friction


def test_the_file_counts_and_not_an_earlier_fit() -> None:
    fitted = moved(link1__mass=1.5)
    found = most_moved(answer(fitted, model_before=fitted))
    assert [n.stated for n in found] == [GIVEN.parameter(MASS).value]


def test_what_the_file_states_stands_beside_a_number_that_a_step_has_named() -> None:
    stated = stated_numbers(answer(GIVEN))
    mass = GIVEN.parameter(MASS)
    own = FoundValue.of(mass, 2.0)
    added = FoundValue(value=0.2, low=0.1, high=0.3, unit="kg", part="added", joints=(1,))
    spread = f" ± {mass.deviation:.2g}" if mass.deviation else ""
    expected = f"{mass.value:.4g}{spread} kg"
    assert stated_beside("wrong_link_mass", MASS, own, stated) == expected
    assert stated_beside("link_mass", "joint1.link_mass.added", added, stated) == expected
    assert (
        stated_beside("spring", "joint1.spring.stiffness", FoundValue(value=1, low=None, high=None, unit="1"), stated)
        == ""
    )
