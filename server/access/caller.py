"""The caller of a request and their role."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from daq.contracts.service.queue import Role
from server.problems import ProblemError

if TYPE_CHECKING:
    from starlette.requests import HTTPConnection


@dataclass(frozen=True)
class Caller:
    """A person or program that sends requests. `name`: name of its token; `local` for a user of this computer without a
    token.

    token: hash of the token that was accepted; None if none was needed
    """

    name: str
    role: Role
    token: str | None = field(default=None, compare=False, repr=False)

    @property
    def spoken(self) -> str:
        """The name in a sentence."""
        return spoken(self.name)

    @property
    def may_operate(self) -> bool:
        """Whether the caller may change anything."""
        return self.role != "viewer"

    def owns(self, owners: Collection[str]) -> bool:
        """Whether the caller is an owner of an arm whose configuration names `owners`; without names, every owner is
        one."""
        return self.role == "admin" or (self.role == "owner" and (not owners or self.name in owners))


LOCAL = Caller("local", "owner")
"""A user of this computer, who reaches a service on loopback without a token and without a proxy."""


def spoken(name: str) -> str:
    """Returns a caller's name for a sentence."""
    return "somebody at the service's computer" if name == LOCAL.name else name


def caller_of(connection: HTTPConnection) -> Caller | None:
    """Returns the caller accepted by the gate; None for an anonymous request."""
    found: Caller | None = getattr(connection.state, "caller", None)
    return found


_BEARER = {"WWW-Authenticate": "Bearer"}


def token_needed() -> ProblemError:
    """Returns a 401 for an anonymous caller."""
    advice = "sign in on the page, or send the header Authorization: Bearer TOKEN; `daq token add` makes one"
    return ProblemError(401, "token-needed", "this service needs a token", advice, (), _BEARER)


def token_unknown() -> ProblemError:
    """Returns a 401 for a token that belongs to nobody."""
    line = "this token is not known, or was revoked"
    return ProblemError(401, "token-unknown", line, "`daq token ls` lists tokens by name", (), _BEARER)


def unknown_name(host: str) -> ProblemError:
    """Returns a 403 for a request to another name than the service's."""
    line = f"this service is not called {host!r:.100}"
    return ProblemError(403, "unknown-name", line, "use its address, or add the name to server.names")


def other_origin(origin: str | None) -> ProblemError:
    """Returns a 403 for a request of another page."""
    line = f"a page of another origin ({origin!r:.100}) may not do this"
    return ProblemError(403, "other-origin", line, "use the page that this service serves")


def require_viewer(connection: HTTPConnection) -> Caller:
    """Returns the caller, who may see the robot. Raises a 401 otherwise."""
    caller = caller_of(connection)
    if caller is None:
        raise token_needed()
    return caller


def require_operator(connection: HTTPConnection) -> Caller:
    """Returns the caller, who may make changes. Raises a 401 or a 403 otherwise."""
    caller = require_viewer(connection)
    if not caller.may_operate:
        line = f"{caller.name} may look, and stop the robot; this needs the role operator"
        raise ProblemError(403, "operator-needed", line, "ask for a token with the role operator")
    return caller
