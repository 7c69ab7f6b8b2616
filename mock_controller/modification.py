"""The base of every modification of the mock: a name, and a state of its own if its effect needs one.

A modification is an object with a `name` that satisfies one or more protocols of `plant.extension_points` and
`board.extension_points`; plant and board select the ones that they support by `of_kind`. If there is none, the inner
loop runs as if the extension point did not exist. Joints are numbered from 1, angles in rad and torques in N·m, at the
joint.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar, Protocol, runtime_checkable


@runtime_checkable
class Modification(Protocol):
    """Anything that changes plant or board; it is requested by its `name`."""

    name: ClassVar[str]


@runtime_checkable
class Restartable(Modification, Protocol):
    """A modification with state of its own, which `restart` resets."""

    def restart(self) -> None: ...


def of_kind(modifications: Iterable[Modification], kind: type) -> list[Any]:
    """Returns the modifications that satisfy the protocol `kind`, in the given order."""
    return [modification for modification in modifications if isinstance(modification, kind)]
