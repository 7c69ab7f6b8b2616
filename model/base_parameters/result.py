"""Base parameters of a machine, and which of them records determine: data first, words last."""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.frozen import FrozenRecord


class BaseMember(FrozenRecord):
    """A standard parameter's part in a base parameter: its `factor`, and the same in terms of the arm's lengths."""

    symbol: str
    factor: float
    written: str


class BaseParameter(FrozenRecord):
    """A combination of standard parameters that determines torques; the first of them represents it.

    `value` is that of the model, in `unit`.
    """

    text: str
    unit: str
    joint: int
    inertial: bool
    members: tuple[BaseMember, ...]
    value: float


class RecordedBaseParameter(FrozenRecord):
    """Information of records on one base parameter.

    `deviation`: in its unit, with all other base parameters free; `relative`: its share of the value, None if the value
    is 0. Both are None if the records do not excite it. `told`: the deviation is at most a tenth of the largest value
    of this unit at the joint, so that a moment of zero can be determined as well.
    """

    deviation: float | None
    relative: float | None
    told: bool


class Excitation(FrozenRecord):
    """Information of records on base parameters, in their order.

    `condition`: condition number of the base parameters' columns along the records, each scaled to unit size. `rank`:
    number of base parameters that they excite at all, numerically, whatever the noise. `residual`: root mean square of
    the model's residual torque, N·m (N), by joint, used as the noise.
    """

    traces: tuple[str, ...]
    samples: int
    rank: int
    condition: float | None
    residual: tuple[float, ...]
    parameters: tuple[RecordedBaseParameter, ...]

    @property
    def told(self) -> int:
        """Number of base parameters that the records determine."""
        return sum(one.told for one in self.parameters)


class BaseParameters(FrozenRecord):
    """The base parameters of a machine, independent of any record, and optionally the information of records on them.

    `standard` counts the standard parameters, `without_effect` names those that influence no motion. `smallest_kept`
    and `largest_dropped` are pivots of the factorisation, as shares of the first: if they differ widely, the rank is
    certain.
    """

    machine: str
    model: str
    standard: int
    parameters: tuple[BaseParameter, ...]
    without_effect: tuple[str, ...]
    postures: int
    seed: int
    smallest_kept: float
    largest_dropped: float
    left_out: tuple[str, ...] = ()
    """Effects of the model that are not part of the base parameters: they are held at the model's values."""
    excitation: Excitation | None = None
    no_excitation: str | None = None
    """Why records could not be judged, in one line."""

    shown = ("machine", "standard", "inertial", "friction")

    @property
    def inertial(self) -> int:
        """Number of inertial base parameters, rotors included."""
        return sum(one.inertial for one in self.parameters)

    @property
    def friction(self) -> int:
        """Number of base parameters of friction."""
        return len(self.parameters) - self.inertial


def headline(found: BaseParameters) -> str:
    """Returns one line for people: the number of base parameters, and how many the records determine."""
    text = f"base parameters: {len(found.parameters)} of {found.standard}"
    text += f" ({found.inertial} inertial, {found.friction} friction)"
    if (records := found.excitation) is not None:
        condition = "" if records.condition is None else f", condition number {records.condition:.3g}"
        text += f"; determined by these traces: {records.told}{condition}"
    return text


def written(first: str, members: Sequence[BaseMember]) -> str:
    """Returns a combination as a sum, after its first member: `ZZ_1 + Ia_1 + a_2² m_3`."""
    text = first
    for one in members:
        sign, size = ("−", one.written[1:]) if one.written.startswith("−") else ("+", one.written)
        text += f" {sign} {one.symbol if size == '1' else f'{size} {one.symbol}'}"
    return text
