"""Messages to and from the stop listener: one JSON object per line, on its standard input and output."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AwareDatetime, Field, TypeAdapter

from daq.contracts.frozen import WHEN_USED, FrozenRecord
from daq.contracts.service.queue import Role

# ---- to the listener


class Begin(FrozenRecord):
    """The first line. `descriptor`: the inherited listening socket. `urls`: each robot's port."""

    kind: Literal["begin"] = "begin"
    descriptor: int
    service_port: int
    open_on_loopback: bool
    names: tuple[str, ...]
    urls: dict[str, str]
    database: Path
    tokens: dict[str, tuple[str, Role]] | None = None
    """Name and role of each valid token, by its digest; None while the service has not read them."""


class Known(FrozenRecord):
    """The tokens, as in `Begin`, once the service has read them."""

    kind: Literal["known"] = "known"
    tokens: dict[str, tuple[str, Role]]


class Owned(FrozenRecord):
    """The process that owns a robot's port now; None if none does. `terminal`: the pseudo-terminal at which the robot
    was reached, as number, time of creation and holder, as in `daq.transport`."""

    kind: Literal["owned"] = "owned"
    robot: str
    process: int | None
    terminal: tuple[int, int, tuple[int, int] | None] | None = None


# ---- from the listener


class Ready(FrozenRecord):
    """The listener now accepts requests."""

    kind: Literal["ready"] = "ready"


class Stopped(FrozenRecord):
    """A requested stop, its result in one line, and its sender."""

    kind: Literal["stopped"] = "stopped"
    robot: str
    text: str
    confirmed: bool
    actor: str
    role: Role
    origin: str
    """Address of the computer that sent the request."""
    address: str
    """Address of the request."""
    at: AwareDatetime


Order = Begin | Known | Owned
ORDER: TypeAdapter[Order] = TypeAdapter(Annotated[Order, Field(discriminator="kind")], config=WHEN_USED)
NEWS: TypeAdapter[Ready | Stopped] = TypeAdapter(
    Annotated[Ready | Stopped, Field(discriminator="kind")], config=WHEN_USED
)
