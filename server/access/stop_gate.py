"""The gate of the stop listener. It follows the rules of the service's gate, and is called on the request's thread."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from server.access.caller import LOCAL, Caller, other_origin, token_needed, token_unknown, unknown_name
from server.access.origin import is_known_name, is_this_computers_user, name_of, place_of


class TokensCannotBeReadError(Exception):
    """The database has not been read, so it is unknown who may stop the robot."""


class Tokens(Protocol):
    """Finds the caller of a token."""

    def remembered(self, token: str) -> tuple[bool, Caller | None]:
        """Returns whether the caller is known without reading the database, and the caller."""
        ...

    def look_up(self, token: str) -> Caller | None:
        """Returns the caller from the database; None for an unknown token."""
        ...


@dataclass(frozen=True)
class StopGate:
    """Accepts everybody who may see the robot. `service_port`: port of the service's page, which may request a stop
    too."""

    tokens: Tokens
    open_on_loopback: bool
    names: tuple[str, ...]
    service_port: int

    def admit(self, headers: Mapping[str, str]) -> Caller:
        """Returns the caller. Raises a 401 or 403, and TokensCannotBeReadError."""
        host = headers.get("host", "")
        if not is_known_name(host, self.names, loopback_only=self.open_on_loopback):
            raise unknown_name(host)
        if not self.is_from_here(headers):
            raise other_origin(headers.get("origin"))
        kind, _, token = headers.get("authorization", "").partition(" ")
        if not token or kind.lower() != "bearer":
            if self.open_on_loopback and is_this_computers_user(headers):
                return LOCAL
            raise token_needed()
        known, caller = self.tokens.remembered(token.strip())
        if not known:
            caller = self.tokens.look_up(token.strip())
        if caller is None:
            raise token_unknown()
        return caller

    def is_from_here(self, headers: Mapping[str, str]) -> bool:
        """Whether a request comes from the service's own page, or from a program, which sends no origin."""
        origin = headers.get("origin")
        if origin is None:
            return headers.get("sec-fetch-site", "none") in ("none", "same-origin")
        return place_of(origin) == (name_of(headers.get("host", "")), self.service_port)
