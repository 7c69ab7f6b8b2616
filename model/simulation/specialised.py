"""What a run is made of, chosen when it is compiled: by the type of a tag, so that compiled code can be cached.

numba caches nothing that is given a function as an argument. Tags are named tuples without meaning but their type; the
functions here have one implementation a type.
"""

# ruff: noqa: ARG001 (what an implementation does not need is part of the face all of them share)

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numba
from numba.extending import overload

from model.dynamics.compilation import inlined

OPTIONS: Any = {"error_model": "numpy", "fastmath": {"contract"}}


class ClosedForm(NamedTuple):
    """The waist-shoulder-elbow arm of rods, rigid transmissions."""

    tag: int


class Flexible(NamedTuple):
    """The same arm where a transmission gives or has play."""

    tag: int


class AnyChain(NamedTuple):
    """Any machine, by the recursive form."""

    tag: int


class NoUserEffect(NamedTuple):
    """No effect of the user's own."""

    tag: int


def entry(function: Callable[..., Any]) -> Any:
    """Compile an entry from Python: cached on disk, and other threads run beside it."""
    return numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})(function)


def user_torque(user: Any, joint: Any, flags: int, time: Any, q: Any, speed: Any) -> Any:
    """Torque (N·m) on a joint from the effects of the user's own that `user` stands for."""
    raise NotImplementedError("for compiled code; effects of the user's own register their torque")


@inlined
def _none(joint: Any, flags: int, time: Any, q: Any, speed: Any) -> Any:
    return 0.0 * (q + joint[0] + time + speed + flags)


@overload(user_torque, jit_options=OPTIONS)
def _no_user_torque(user: Any, joint: Any, flags: Any, time: Any, q: Any, speed: Any) -> Any:
    if getattr(user, "instance_class", None) is not NoUserEffect:
        return None

    def torque(user: Any, joint: Any, flags: Any, time: Any, q: Any, speed: Any) -> Any:
        return _none(joint, flags, time, q, speed)

    return torque
