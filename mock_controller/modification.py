"""What every modification of the mock has: a name, and a state of its own where its effect needs one.

A modification is an object with a `name` that satisfies one or more protocols of `plant.extension_points` and
`board.extension_points`; plant and board pick those they know by `of_kind`. Where none is present the inner loop runs
as if the extension point did not exist. Joints are numbered from 1, angles in rad and torques in N·m, at the joint.
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
    """A modification with state of its own, which `restart` brings back to its beginning."""

    def restart(self) -> None: ...


def of_kind(modifications: Iterable[Modification], kind: type) -> list[Any]:
    """The modifications that satisfy the protocol `kind`, in the order given."""
    return [modification for modification in modifications if isinstance(modification, kind)]
