"""What a notebook and `print` show of a fit: the numbers, in brackets those that the data do not determine."""

import xml.etree.ElementTree as ET
from typing import Any

from model.fitting.fitted import FittedParameter, JointError
from model.fitting.identifiability import Combination, IdentifiabilityReport
from model.fitting.shown import doubt_of, html_of, known_of, text_of

NAMES = ("value", "deviation", "low", "high", "expected", "expected_deviation", "at_bound")
NONE: dict[str, Any] = dict.fromkeys(NAMES)


def parameter(name: str, unit: str, verdict: str, before: float, **numbers: float | str) -> FittedParameter:
    values = NONE | {"name": name, "unit": unit, "verdict": verdict, "before": before, "reason": "", "model_value": 1.0}
    return FittedParameter.model_validate(values | numbers)


LOAD = parameter("load.mass", "kg", "known", 1.25, value=1.25037, deviation=0.0069, low=1.2368, high=1.2639)
EMF = parameter("<b>.back_emf", "V·s/rad", "combination", 0.0334)
ARM = parameter("arm", "m", "known", 0.1, value=0.0, deviation=0.01, low=0.0, high=0.0196, at_bound="low")
UNDETERMINED = Combination(text="together a +1 %, <b> −1 %", members=(), torque_scale=False, deviation=None)
REPORT = IdentifiabilityReport(parameters=(), undetermined=(UNDETERMINED,), correlated=(), torque_scale_free=False)


def test_the_table_in_a_terminal_has_numbers_where_the_data_determine_one() -> None:
    head, *rows, below = text_of((LOAD, EMF, ARM), REPORT).splitlines()
    assert head.split() == ["parameter", "value", "95", "%", "interval", "unit", "before"]
    assert [row.split() for row in rows] == [
        ["load.mass", "1.2504", "1.2368", "to", "1.2639", "kg", "1.25"],
        ["<b>.back_emf", "(1)", "only", "in", "combination", "V·s/rad", "0.0334"],
        ["arm", "0", "0", "to", "0.0196,", "at", "its", "lower", "bound", "m", "0.1"],
    ]
    assert len({row.rindex(f" {unit} ") for row, unit in zip(rows, ("kg", "V·s/rad", "m"), strict=True)}) == 1
    assert below == "not determined: together a +1 %, <b> −1 %"
    assert known_of((LOAD, EMF, ARM)) == "2 of 3 parameters known"


def test_the_table_of_a_notebook_has_the_same_and_names_are_no_html() -> None:
    page = ET.fromstring(html_of("FitResult <of it>", (LOAD, EMF, ARM), REPORT))
    rows = [["".join(cell.itertext()) for cell in row] for row in page.iter("tr")]
    assert rows[0][:4] == ["parameter", "value", "95 % interval", "unit"]
    assert rows[1] == ["load.mass", "1.2504", "1.2368 to 1.2639", "kg", "1.25"]
    assert rows[2][1:3] == ["(1)", "only in combination"]
    text = "".join(page.itertext())
    assert text.startswith("FitResult <of it>")
    assert text.endswith("not determined: together a +1 %, <b> −1 %")


def error(joint: int, before: float, after: float) -> JointError:
    return JointError(joint=joint, unit="rad", before=before, after=after, floor=1e-4)


def test_a_fit_that_ends_farther_from_its_records_than_it_began_is_doubted() -> None:
    assert doubt_of((error(1, 0.1, 0.01), error(2, 0.010, 0.012), error(3, 0.0001, 0.002))) == ""
    line = doubt_of((error(1, 0.1, 0.01), error(2, 0.1, 0.7)))
    assert line.startswith("the fitted model is farther from the records than before (joint 2): do not use its values.")
    page = ET.fromstring(html_of("fit", (LOAD,), REPORT, [f"WARNING {line}"]))
    assert "".join(page.itertext()).endswith(f"WARNING {line}")
