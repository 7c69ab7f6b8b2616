"""Wrong input to a fit: one clear error, never a number that looks like a result."""

import json
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import DaqError, SpecError, TraceError
from daq.contracts.trace import Trace
from model.fitting.fit import fit
from model.fitting.options import FitOptions, Prior
from model.fitting.result import load_result
from tests.model.fitting.imagined import arm, changed, trace

SOME = FitOptions(parameters=("load.mass",), sensor_bend=False, replicas=0, rounds=1)


@pytest.fixture(scope="module")
def good() -> Trace:
    return trace(arm(), 0, 3.0)


def refused(given: list[Trace], options: FitOptions = SOME) -> str:
    with pytest.raises(DaqError) as error:
        fit(arm(), given, options)
    text = str(error.value)
    assert "\n" not in text
    return text


def test_no_trace() -> None:
    assert "at least one" in refused([])


def test_the_same_trace_twice(good: Trace) -> None:
    assert "more than once" in refused([good, good])


def test_a_value_that_is_not_finite_is_refused(good: Trace) -> None:
    position = good.position.copy()
    position[17, 1] = np.nan
    with pytest.raises(TraceError, match="not finite at sample 17"):
        fit(arm(), [changed(good, position=position)], SOME)


def test_a_trace_without_one_joint_is_refused(good: Trace) -> None:
    columns = {n: getattr(good, n)[:, :2] for n in ("position", "set_point", "error", "drive")}
    assert "joint 3 is not in it" in refused([changed(good, joints=(1, 2), **columns)])


@pytest.mark.parametrize("signals", [("position", "set_point"), ("position",), ("set_point",)])
def test_degrees_for_radians(good: Trace, signals: tuple[str, ...]) -> None:
    text = refused([changed(good, **{n: np.degrees(getattr(good, n)) for n in signals})])
    assert "rad" in text
    assert "degrees" in text or "apart throughout" in text


def test_no_set_points(good: Trace) -> None:
    assert "set points" in refused([changed(good, set_point=None)])


@pytest.mark.parametrize(
    "options",
    [
        FitOptions(parameters=("load.weight",)),
        FitOptions(held=("nothing.*",)),
        FitOptions(bounds={"load.weight": (0, 1)}),
        FitOptions(priors={"load.weight": Prior(expected=1, deviation=1)}),
    ],
)
def test_an_unknown_parameter_name_is_refused(good: Trace, options: FitOptions) -> None:
    assert "not in this model" in refused([good], options)


def test_nothing_left_to_fit(good: Trace) -> None:
    assert "nothing to fit" in refused([good], FitOptions(held=("*",)))


def test_a_result_of_a_newer_version(tmp_path: Path) -> None:
    (tmp_path / "new.json").write_text(json.dumps({"format": 99}), "utf-8")
    with pytest.raises(SpecError, match="format 99 is newer"):
        load_result(tmp_path / "new.json")


@pytest.mark.parametrize("text", ["", "[1, 2]", "{}", '{"format": 1, "model": 3}'])
def test_a_file_that_is_no_result(tmp_path: Path, text: str) -> None:
    (tmp_path / "other.json").write_text(text, "utf-8")
    with pytest.raises(SpecError):
        load_result(tmp_path / "other.json")
