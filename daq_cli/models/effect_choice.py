"""Effects, parameters and bounds as the command line names them."""

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

    A name may be abbreviated as long as it is unique. Without joints an effect acts on every joint it can act on, or on
    the whole machine. Raises SpecError with one line.
    """
    from model.effects.library import effect

    if text.strip() == NO_EFFECT:
        return model
    for part in text.split(","):
        name, _, joints = part.strip().partition(":")
        found = effect_name(name)
        if effect(found).whole_machine:
            if joints:
                raise SpecError(f"effect {found}: belongs to the whole machine; write it without {':' + joints!r}")
            model = model.with_effect(found)
        else:
            model = model.with_effect(found, parse_joints(joints) if joints else _joints_of(found, model))
    return model


def effect_choices(text: str | None, files: Sequence[Path] | None = None) -> tuple[EffectChoice, ...]:
    """Effects written as for `with_effects`, for traces whose models are not known yet; those of files are loaded
    first. Raises SpecError."""
    from daq.contracts.service.jobs import EffectChoice

    load_effects(files or ())
    if text is None or text.strip() == NO_EFFECT:
        return ()
    found = []
    for part in text.split(","):
        name, _, joints = part.strip().partition(":")
        found.append(EffectChoice(name=effect_name(name), joints=tuple(parse_joints(joints)) if joints else ()))
    return tuple(found)


def candidate_effects(text: str | None, files: Sequence[Path] | None = None) -> tuple[str, ...] | None:
    """Candidates for a diagnosis, likewise; None for every effect."""
    load_effects(files or ())
    return None if text is None else effect_names(text)


def _joints_of(name: str, model: Model) -> tuple[int, ...]:
    """Every joint that the effect may act on."""
    from model.effects.library import effect

    own = effect(name).joints
    return tuple(j for j in model.machine.modelled_joints if not own or j in own)


def effect_name(text: str) -> str:
    """The one effect whose name begins with `text`. Raises SpecError, which lists the effects that it could be."""
    from model.effects.library import library

    name = text.strip().replace("-", "_")
    if name in library():
        return name
    begun = [n for n in library() if name and n.startswith(name)]
    if len(begun) == 1:
        return begun[0]
    if begun:
        raise SpecError(f"effect {text!r}: could be {', '.join(begun)}")
    raise SpecError(f"effect {text!r}: not in the library; it has {', '.join(library())}")


def effect_names(text: str) -> tuple[str, ...]:
    """The effects of a list such as `backlash,coulomb`, for commands with an option of their own for joints. Raises
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
    """Names or patterns of parameters, separated by commas; None where nothing is said."""
    if text is None:
        return None
    found = tuple(part.strip() for part in text.split(",") if part.strip())
    if not found:
        raise SpecError("no parameter named: write names or patterns like link2.mass,*.viscous_friction.*")
    return found


def bounds(texts: Sequence[str]) -> dict[str, tuple[float | None, float | None]]:
    """Bounds written `link2.mass=0.3:0.9`, either side may be left out. Raises SpecError with one line."""
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
