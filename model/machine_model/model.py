"""A model: a machine, the effects in it, and the values of its parameters. Immutable; saved with its lineage."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, FiniteFloat, SerializerFunctionWrapHandler, model_serializer, model_validator

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.machine import Machine, load_machine
from daq.contracts.service.jobs import EffectChoice
from model import layout as at
from model.effects.effect import EffectFile, Tone
from model.effects.library import effect, effect_from
from model.machine_model.effect_parameters import effect_parameters
from model.machine_model.nominal import base_parameters, joint_scale, nominal_vector
from model.machine_model.parameter import Parameter

MODEL_FORMAT = 1
"""Version of the model file; a reader rejects newer ones."""

FRICTION_OF_MACHINE = {
    "viscous_friction": ("viscous_motor_side", "viscous"),
    "load_dependent_friction": ("coulomb_arm",),
    "coulomb_friction": ("coulomb",),
}
"""Effects for which a machine file gives values, and its entries for them."""


class EffectUse(FrozenRecord):
    """An effect in a model: its joints (none for the whole machine), with values of their own or shared ones.

    `file` is the file of a user's effect, as it was when the model was made.
    """

    name: str
    joints: tuple[int, ...] = ()
    shared: bool = False
    file: EffectFile | None = None

    @model_serializer(mode="wrap")
    def _without_no_file(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Omits missing files, so that models without files keep their identity."""
        data: dict[str, Any] = handler(self)
        if self.file is None:
            del data["file"]
        return data


class Lineage(FrozenRecord):
    """Origin of a model: identity of its parent model, traces, and a summary of the fit."""

    parent: str | None = None
    traces: tuple[str, ...] = ()
    fit: dict[str, Any] | None = None
    note: str = ""


class Model(FrozenRecord):
    """A machine with effects and parameter values.

    `values` holds the parameters that differ from the machine file and from the effects' starting values, by name.
    `ties` maps a name to parameters that share one value, `{"motor.back_emf_constant": ("joint1.…", "joint3.…")}`.

    Raises SpecError (through the methods that change it) for an unknown effect, joint or parameter.
    """

    shown: ClassVar[tuple[str, ...]] = ("identity", "machine", "effects", "values")
    format: Annotated[int, Field(ge=1)] = MODEL_FORMAT
    machine: Machine
    effects: tuple[EffectUse, ...] = ()
    values: dict[str, FiniteFloat] = {}
    ties: dict[str, Annotated[tuple[str, ...], Field(min_length=2)]] = {}
    published_inertia: bool = False
    """Inertia of link 3 with its load as published (7.28) instead of exactly."""
    lineage: Lineage = Lineage()

    @model_validator(mode="after")
    def _known(self) -> Self:
        taken: set[tuple[str, int]] = set()
        for use in self.effects:
            _check_use(self.machine, use)
            own = {(use.name, joint) for joint in use.joints or (0,)}
            if len(own) < len(use.joints) or not taken.isdisjoint(own):
                raise SpecError(f"effect {use.name}: in the model twice for the same joint")
            taken |= own
        _check_own(self.effects)
        if unknown := sorted(set(self.values) - set(self.by_name)):
            raise SpecError(f"parameter {shown(unknown[0])}: this model has {', '.join(self.by_name)}")
        for p in self.parameters:
            if not p.low <= p.value <= p.high:
                raise SpecError(f"{p.name} = {p.value} {p.unit}: allowed are {p.low} to {p.high}")
        return self

    @property
    def disturbances(self) -> tuple[tuple[Parameter, Parameter], ...]:
        """Sine and cosine of every torque that repeats over time; only those of the first joint if joints share one."""
        own = [p for p in self.parameters if p.effect is not None and effect(p.effect).tone is Tone.OVER_TIME]
        cosines = {p.joints: p for p in own if p.part == "cosine"}
        return tuple((p, cosines[p.joints]) for p in own if p.part == "sine" and p.joints in cosines)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Every parameter of the model: the machine's own, then those of its effects, with the model's values."""
        found = [*base_parameters(self.machine)]
        taken: set[int] = set()
        for use in self.effects:
            beyond = self.own_columns.get(use.name, 0)
            own = _not_taken(effect_parameters(self.machine, use.name, use.joints, use.shared, beyond), taken)
            taken.update(slot for p in own for slot in p.slots)
            found.extend(own)
        found = _tied(found, self.ties)
        return tuple(p if p.name not in self.values else replace(p, value=self.values[p.name]) for p in found)

    @cached_property
    def own_columns(self) -> dict[str, int]:
        """For each user effect: the number of a joint's user-effect columns before its own."""
        columns, taken = {}, 0
        for use in self.effects:
            if use.file is not None and use.name not in columns:
                columns[use.name] = taken
                taken += len(effect(use.name).parameters)
        return columns

    @cached_property
    def by_name(self) -> dict[str, Parameter]:
        """Parameters by name."""
        return {p.name: p for p in self.parameters}

    def parameter(self, name: str) -> Parameter:
        """Returns the parameter of that name. Raises SpecError with the most similar names."""
        if name not in self.by_name:
            last = name.rpartition(".")[2]
            near = [n for n in self.by_name if n.partition(".")[0] == name.partition(".")[0] or n.endswith(last)]
            raise SpecError(f"parameter {name!r}: not in this model; it has {', '.join(near or self.by_name)}")
        return self.by_name[name]

    @cached_property
    def joint_count(self) -> int:
        """Number of joints that the model moves."""
        return len(self.machine.modelled_joints)

    @cached_property
    def vector(self) -> NDArray[np.float64]:
        """The flat vector (layout.size(n),) that compiled code reads. Read-only."""
        vector = nominal_vector(self.machine)
        for p in self.parameters:
            vector[list(p.slots)] = p.value
        vector[at.PUBLISHED_INERTIA] = float(self.published_inertia)
        vector.setflags(write=False)
        return vector

    @cached_property
    def flags(self) -> NDArray[np.int64]:
        """(n,) bits of the state-changing effects of every joint (`layout.HAS_…`)."""
        flags = np.zeros(self.joint_count, dtype=np.int64)
        for use in self.effects:
            for joint in use.joints:
                flags[joint - 1] |= effect(use.name).flag
        flags.setflags(write=False)
        return flags

    @cached_property
    def identity(self) -> str:
        """Twelve hexadecimal digits that identify the content of the model's file, its lineage included."""
        return hashlib.sha256(self.model_dump_json().encode()).hexdigest()[:12]

    def with_values(self, values: Mapping[str, float]) -> Model:
        """Returns the model with other values. Raises SpecError for an unknown name, or a value outside its bounds."""
        for name, value in values.items():
            p = self.parameter(name)
            if not math.isfinite(value):
                raise SpecError(f"{name} = {value} {p.unit}: allowed are {p.low} to {p.high}")
        return self._changed(values={**self.values, **{n: float(v) for n, v in values.items()}})

    def with_effect(
        self, name: str, joints: tuple[int, ...] = (), values: Mapping[str, float] | None = None, shared: bool = False
    ) -> Model:
        """Returns the model with one more effect, at its null values, where it does nothing; shapes are typical.

        `values` are by full name, or by the parameter's last part, then for every joint of the effect.
        """
        use = EffectUse(name=name, joints=joints, shared=shared, file=effect(name).file)
        _check_use(self.machine, use)
        wider = self._changed(effects=(*self.effects, use))
        chosen: dict[str, float] = {}
        for key, value in (values or {}).items():
            own = effect_parameters(self.machine, name, joints, shared)
            matching = [p.name for p in own if key in (p.name, p.part)]
            if not matching:
                raise SpecError(f"effect {name} has no parameter {key!r}; it has {', '.join(p.name for p in own)}")
            chosen.update(dict.fromkeys(matching, value))
        return wider.with_values(chosen) if chosen else wider

    def with_effects(self, choices: Iterable[EffectChoice]) -> Model:
        """Returns the model with more effects; one without joints acts on all possible ones. Raises SpecError."""
        model = self
        for choice in choices:
            found = effect(choice.name)
            every = tuple(j for j in self.machine.modelled_joints if not found.joints or j in found.joints)
            model = model.with_effect(choice.name, () if found.whole_machine else choice.joints or every)
        return model

    def without_effect(self, name: str, joints: tuple[int, ...] | None = None) -> Model:
        """Returns the model without an effect, on the given joints or anywhere. Raises SpecError if it lacks the
        effect."""
        uses = [u for u in self.effects if u.name == name and (joints is None or set(u.joints) & set(joints))]
        if not uses:
            raise SpecError(
                f"effect {name!r}: not in this model; it has {', '.join(u.name for u in self.effects) or 'none'}"
            )
        kept: list[EffectUse] = []
        for use in self.effects:
            left = tuple(j for j in use.joints if joints is not None and j not in joints) if use in uses else use.joints
            if use not in uses or left:
                kept.append(use.model_copy(update={"joints": left}))
        names = {p.name for p in base_parameters(self.machine)} | set(self.ties)
        for use in kept:
            names |= {p.name for p in effect_parameters(self.machine, use.name, use.joints, use.shared)}
        return self._changed(effects=tuple(kept), values={n: v for n, v in self.values.items() if n in names})

    def tied(self, name: str, members: tuple[str, ...]) -> Model:
        """Returns the model with several parameters sharing one value, that of the first, under a new name."""
        value = self.parameter(members[0]).value
        for member in members[1:]:
            self.parameter(member)
        values = {n: v for n, v in self.values.items() if n not in members} | {name: value}
        return self._changed(ties={**self.ties, name: members}, values=values)

    def with_lineage(self, lineage: Lineage) -> Model:
        """Returns the model with another lineage."""
        return self._changed(lineage=lineage)

    def _changed(self, **changes: Any) -> Model:
        fields = {name: getattr(self, name) for name in type(self).model_fields}
        return type(self)(**{**fields, **changes})


def base_model(machine: Machine | str, *, friction: bool = True) -> Model:
    """Returns the model of a machine file: rigid bodies, motors and the friction that it states.

    machine: a machine, the name of one that ships, or the path of a file. Raises SpecError.
    """
    machine = load_machine(machine) if isinstance(machine, str) else machine
    uses = []
    if friction:
        for name, entries in FRICTION_OF_MACHINE.items():
            joints = tuple(
                j
                for j in machine.modelled_joints
                if any(getattr(machine.joint(j).friction, e) is not None for e in entries)
            )
            uses += [EffectUse(name=name, joints=joints)] if joints else []
    for joint in machine.modelled_joints:
        joint_scale(machine, joint)  # rejects a joint without inertia
    return Model(machine=machine, effects=tuple(uses))


def _check_own(uses: tuple[EffectUse, ...]) -> None:
    own = {use.name: use for use in uses if effect(use.name).file is not None}
    if unnamed := [name for name, use in own.items() if use.file is None]:
        raise SpecError(f"effect {unnamed[0]}: the model does not state its file")
    if (taken := sum(len(effect(name).parameters) for name in own)) > at.USER_COLUMNS:
        raise SpecError(
            f"effects {', '.join(own)}: {taken} parameters; a model has room for {at.USER_COLUMNS} of users' effects"
        )


def _check_use(machine: Machine, use: EffectUse) -> None:
    kind = effect_from(use.name, use.file)
    if kind.whole_machine and use.joints:
        raise SpecError(f"effect {use.name} belongs to the whole machine, not to joints {list(use.joints)}")
    if not kind.whole_machine and not use.joints:
        raise SpecError(f"effect {use.name}: name the joints it acts on, of {list(machine.modelled_joints)}")
    for joint in use.joints:
        if not 1 <= joint <= len(machine.modelled_joints):
            raise SpecError(
                f"effect {use.name} on joint {joint}: not modelled; modelled joints are {list(machine.modelled_joints)}"
            )
        if kind.joints and joint not in kind.joints:
            raise SpecError(f"effect {use.name} on joint {joint}: its file allows only joints {list(kind.joints)}")


def _not_taken(own: tuple[Parameter, ...], taken: set[int]) -> list[Parameter]:
    """Leaves out parameters whose column an earlier effect uses: backlash and compliance of a joint share a damping."""
    left = [replace(p, slots=tuple(s for s in p.slots if s not in taken)) for p in own]
    return [p for p in left if p.slots]


def _tied(found: list[Parameter], ties: Mapping[str, tuple[str, ...]]) -> list[Parameter]:
    """Replaces the first of the parameters that share a value by one parameter, tie by tie."""
    left: list[Parameter | None] = [*found]
    places = {p.name: place for place, p in enumerate(found)}
    for name, members in ties.items():
        if unknown := sorted(set(members) - places.keys()):
            raise SpecError(f"tie {shown(name)}: {shown(unknown)} are not parameters of the model")
        if len(set(members)) < len(members):
            raise SpecError(f"tie {shown(name)}: names a parameter twice")
        own = sorted(places.pop(member) for member in members)
        if name in places:
            raise SpecError(f"tie {shown(name)}: the model already has a parameter of this name")
        tied = [p for place in own if (p := left[place]) is not None]
        for place in own:
            left[place] = None
        places[name] = own[0]
        left[own[0]] = replace(
            tied[0],
            name=name,
            slots=tuple(s for p in tied for s in p.slots),
            low=max(p.low for p in tied),
            high=min(p.high for p in tied),
            joints=tuple(sorted({j for p in tied for j in p.joints})),
        )
    return [p for p in left if p is not None]
