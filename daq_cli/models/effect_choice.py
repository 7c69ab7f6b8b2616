"""Parses effects, parameters and bounds from the command line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.errors import SpecError
from daq.contracts.experiment import parse_joints
from daq_cli.models.model_input import load_effects

if TYPE_CHECKING:
    from daq.contracts.service.jobs import EffectChoice
    from model.machine_model.model import Model

NO_EFFECT = "none"


def with_effects(model: Model, text: str) -> Model:
    """Adds effects written as `viscous,coulomb:2-3` to a model; `none` adds none.

    Names may be abbreviated if unique. Without joints, an effect acts on every possible joint, or on the whole machine.
    Raises a one-line SpecError.
    """
    return model.with_effects(effect_choices(text))


def effect_choices(text: str | None, files: Sequence[Path] | None = None) -> tuple[EffectChoice, ...]:
    """Returns effects written as for `with_effects`, for traces whose models are not yet known; effect files are loaded
    first. Raises SpecError."""
    from daq.contracts.service.jobs import EffectChoice
    from model.effects.library import effect

    load_effects(files or ())
    if text is None or text.strip() == NO_EFFECT:
        return ()
    found = []
    for part in text.split(","):
        name, _, joints = part.strip().partition(":")
        one = EffectChoice(name=effect_name(name), joints=tuple(parse_joints(joints)) if joints else ())
        if one.joints and effect(one.name).whole_machine:
            raise SpecError(f"effect {one.name}: belongs to the whole machine; write it without {':' + joints!r}")
        found.append(one)
    return tuple(found)


def candidate_effects(text: str | None, files: Sequence[Path] | None = None) -> tuple[str, ...] | None:
    """Returns the candidates of a diagnosis in the same way; None for all effects."""
    load_effects(files or ())
    return None if text is None else effect_names(text)


def effect_name(text: str) -> str:
    """Returns the only effect whose name begins with `text`. Raises SpecError, which lists the possible effects."""
    from model.effects.library import effect, library

    name = text.strip().replace("-", "_")
    if name in library():
        return name
    begun = [n for n in library() if name and n.startswith(name)]
    if len(begun) == 1:
        return begun[0]
    if begun:
        raise SpecError(f"effect {text!r}: could be {', '.join(begun)}")
    return effect(name).name


def effect_names(text: str) -> tuple[str, ...]:
    """Returns the effects in a list such as `backlash,coulomb`, for commands with a separate option for joints. Raises
    SpecError."""
    found = []
    for part in text.split(","):
        name, colon, joints = part.strip().partition(":")
        if colon:
            raise SpecError(
                f"effect {part.strip()!r}: joints go with --joints here, for all effects alike: "
                f"--effects {name} --joints {joints or '2'}"
            )
        found.append(effect_name(part))
    return tuple(found)


def patterns(text: str | None) -> tuple[str, ...] | None:
    """Returns names or patterns of parameters, separated by commas; None if none are given."""
    if text is None:
        return None
    found = tuple(part.strip() for part in text.split(",") if part.strip())
    if not found:
        raise SpecError("no parameter named: write names or patterns like link2.mass,*.viscous_friction.*")
    return found


def bounds(texts: Sequence[str]) -> dict[str, tuple[float | None, float | None]]:
    """Parses bounds such as `link2.mass=0.3:0.9`; either side may be left out. Raises a one-line SpecError."""
    found: dict[str, tuple[float | None, float | None]] = {}
    for text in texts:
        match = re.fullmatch(r"\s*([\w.+]+)\s*=\s*([^:]*):([^:]*)", text)
        if match is None:
            raise SpecError(f"bound {text!r}: write name=low:high, either may be left out")
        try:
            low, high = (float(side) if side.strip() else None for side in match.groups()[1:])
        except ValueError:
            raise SpecError(f"bound {text!r}: low and high must be numbers") from None
        if low is not None and high is not None and not low < high:
            raise SpecError(f"bound {text!r}: the lower bound {low:g} is not below the upper {high:g}")
        found[match[1]] = (low, high)
    return found
