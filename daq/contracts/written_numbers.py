"""Parses numbers as people write them in a machine file: `"0.8 ± 0.08 kg, scales"`."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pint

UNSTATED = "source not stated"
"""Source of a number without a comment."""
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_WRITTEN = re.compile(
    rf"(?P<value>{_NUMBER})\s*(?:(?:±|\+/?-)\s*(?P<deviation>{_NUMBER})\s*(?P<percent>%(?=\s*[^\s,\[%]))?)?"
    rf"\s*(?P<unit>[^\s,\[±+-][^,\[±]*?)?\s*(?:(?:±|\+/?-)\s*(?P<share>{_NUMBER})\s*(?P<of>%|[^\s,\[%][^,\[%]*?))?"
    rf"\s*(?:\[\s*(?P<low>{_NUMBER})?\s*to\s*(?P<high>{_NUMBER})?\s*\])?\s*(?:,\s*(?P<source>.*?))?\s*",
    re.DOTALL,
)
_COMMA = re.compile(r"(?:^|[^,]*?[\s±\[+-])[\d.]+(?:,| (?=\d{3}\b))\d")
"""A decimal comma, or a group of thousands, in front of any source."""
EXAMPLE = '"0.8 ± 0.08 kg" or "0.8 kg ± 10 % [0 to 2], its source"'
_COMMON = {
    ("deg", "rad"): math.pi / 180.0,
    ("°", "rad"): math.pi / 180.0,
    ("mm", "m"): 1e-3,
    ("g", "kg"): 1e-3,
    ("ms", "s"): 1e-3,
    ("mH", "H"): 1e-3,
}
"""Factors of common units. Files with only these load without pint, whose import takes 0.5 s."""
SPEED_CONSTANT = "V·s/rad"
NUMBERS = ("value", "low", "high", "deviation")
"""Fields of a number that have its unit."""


@dataclass(frozen=True)
class Units:
    """Marks a type with the units that its number may have in the model.

    sliding: the units on a prismatic joint, if they differ.
    """

    allowed: tuple[str, ...]
    sliding: tuple[str, ...] = ()


def is_number(text: str) -> bool:
    """Whether a text has the form of a number with unit."""
    return _WRITTEN.fullmatch(_plain_signs(text)) is not None


def read_number(written: str | float, comment: str, allowed: Sequence[str]) -> dict[str, Any]:
    """Returns the fields of a `Quantity` for a written number, in the first of the `allowed` units that it converts to.

    comment: the source, if the number states none. Raises ValueError.
    """
    text = _plain_signs(written) if isinstance(written, str) else repr(float(written))
    match = _WRITTEN.fullmatch(text)
    if _COMMA.match(text):
        raise ValueError(f"found {written!r:.80}: write decimals with a point, thousands without a sign: 0.8, 1200")
    if match is None:
        raise ValueError(f"found {written!r:.80}, must be a number like {EXAMPLE}")
    found: dict[str, Any] = {"value": float(match["value"])}
    for side in ("low", "high"):
        if match[side] is not None:
            found[side] = float(match[side])
    found["unit"] = (match["unit"] or "").strip()
    share = match["percent"] is not None or match["of"] == "%"
    if match["of"] not in (None, "%", found["unit"]):
        raise ValueError(f"found {written!r:.80}: the deviation's unit must be {found['unit']} or %")
    if (deviation := match["deviation"] or match["share"]) is not None:
        found["deviation"] = _short(abs(found["value"]) * float(deviation) / 100) if share else float(deviation)
    if not found["unit"]:
        if len(allowed) != 1:
            raise ValueError(f"found {written!r:.80}, which has no unit: write {' or '.join(allowed)}")
        found["unit"] = allowed[0]
    source = match["source"] or comment or UNSTATED
    assumed = re.match(r"(?:assumed: |guess\b(?:: )?)(.*)", source, re.DOTALL)
    if assumed is not None:
        found["assumed"] = True
        source = assumed[1] if ": " in source[:9] and assumed[1] else source
    return converted(found | {"source": source}, allowed)


def converted(number: Mapping[str, Any], allowed: Sequence[str]) -> dict[str, Any]:
    """Returns a number's fields in the first of the `allowed` units that it converts to. Raises ValueError."""
    unit = _written_alike(str(number["unit"]))
    for one in allowed:
        if _written_alike(one) == unit:
            return {**number, "unit": one}
    for one in allowed:
        found = _factor(unit, one)
        if found is not None:
            factor, inverse = found
            return _inverted(number, one, factor) if inverse else _scaled(number, one, factor)
    speed = _factor(unit, SPEED_CONSTANT) if "N·m/A" in allowed else None
    hint = "" if speed is None else ": it is a speed constant, written as back_emf_constant, or its reciprocal in N·m/A"
    units = " or ".join(map(repr, allowed))
    raise ValueError(f"unit is {number['unit']!r}, must be {units}, or one that converts{hint}")


def _scaled(number: Mapping[str, Any], unit: str, factor: float) -> dict[str, Any]:
    own = {name: _short(number[name] * factor) for name in NUMBERS if number.get(name) is not None}
    return {**number, **own, "unit": unit}


def _inverted(number: Mapping[str, Any], unit: str, factor: float) -> dict[str, Any]:
    """Converts a speed constant to a back-EMF constant: 1/x, with the relative deviation of x."""
    value = number["value"]
    if value == 0.0:
        raise ValueError(f"value 0 {number['unit']} has no reciprocal in {unit}")
    own = {"value": _short(factor / value)}
    for side, other in (("low", "high"), ("high", "low")):
        if number.get(other):
            own[side] = _short(factor / number[other])
    if number.get("deviation") is not None:
        own["deviation"] = _short(abs(number["deviation"] * factor / value**2))
    return {**number, "low": None, "high": None, **own, "unit": unit}


def _short(value: float) -> float:
    """Removes the digits that only the conversion added."""
    rounded = float(f"{value:.12g}")
    return rounded if abs(rounded - value) <= 5e-16 * abs(value) else value


@cache
def _registry() -> pint.UnitRegistry[Any]:
    import pint  # takes 0.5 s; only for files with other units

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(cache_folder=None)
    registry.define("@alias turn = rev")
    return registry


@cache
def _factor(unit: str, target: str) -> tuple[float, bool] | None:
    """Returns the factor from `unit` to `target`, and whether the number must be inverted.

    The radian counts as 1, unless an angle is required. Pounds and kilograms count as forces if a force is required
    (kg·cm, lb·in), as in data sheets.
    """
    if (unit, target) in _COMMON:
        return _COMMON[unit, target], False
    import pint

    registry = _registry()
    try:
        given, wanted = (registry.Quantity(1.0, _for_pint(name)).to_root_units() for name in (unit, target))
    except Exception:  # noqa: BLE001 - pint's errors of a text have no common class
        return None
    assert isinstance(given, pint.Quantity)
    pull = registry.Quantity(1.0, "standard_gravity").to_root_units()
    for inverse, own in ((False, given), (True, 1 / given), (False, given * pull)):
        ratio = own / wanted
        angles = dict(ratio.units._units)
        rest = angles.pop("radian", 0)
        plain = target in ("1", "%", "count", "rad")
        if not angles and (not rest or ("rad" in target and not plain)) and not (inverse and plain):
            return float(ratio.magnitude), inverse
    return None


def _for_pint(unit: str) -> str:
    return "dimensionless" if unit == "1" else unit.replace("·", "*")


def _written_alike(unit: str) -> str:
    """Normalises a unit: middle dots for products, superscripts for powers."""
    text = re.sub(r"\s*(?:\*(?!\*)|⋅|∙|•|·)\s*", "·", unit.strip()).replace("Ω", "Ω").replace("\u00b5", "µ")
    text = re.sub(r"(?:\^|\*\*)([23])", lambda m: "²³"[int(m[1]) - 2], text)
    text = re.sub(r"(?<=[A-Za-z])[.-](?=[A-Za-z])", "·", re.sub(r"\bohms?\b", "Ω", text))  # oz-in, kgf.cm
    return re.sub(r"\b([mkµ]?N|k?g|kgf|ozf?|lbf?)(c?m|in)(?![a-z])", r"\1·\2", text)


def _plain_signs(text: str) -> str:
    return text.strip().replace("−", "-")


def number_text(number: Mapping[str, Any]) -> str:
    """Returns a number in the short form, without its source and without a lower bound of 0."""
    unit = "" if number["unit"] == "1" else f" {number['unit']}"
    deviation = "" if number.get("deviation") is None else f" ± {_digits(number['deviation'])}"
    low, high = number.get("low"), number.get("high")
    if low == 0.0 and high is None:
        low = None
    sides = "" if low is None and high is None else f" [{_bound(low)}to{_bound(high, ' ')}]"
    return f"{_digits(number['value'])}{deviation}{unit}{sides}"


def _bound(value: float | None, before: str = "") -> str:
    if value is None:
        return ""
    return f"{before}{_digits(value)}" if before else f"{_digits(value)} "


def _digits(value: float) -> str:
    text = repr(float(value))
    return text.removesuffix(".0")
