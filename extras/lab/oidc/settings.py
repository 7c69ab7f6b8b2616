"""The configuration of sign-in by OpenID Connect: the provider, and its claims that give names and roles."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, field_validator, model_validator

from daq.config.section import Section
from daq.config.service import ServiceSettings, protected
from daq.config.settings import Settings
from daq.contracts.errors import SpecError
from daq.contracts.service.queue import Role

Claim = Annotated[str, Field(min_length=1, max_length=200)]


class OidcSettings(Section):
    """Section `[oidc]`. Without an issuer, people use tokens. The provider sends people back to /api/v1/login/callback
    below `server.address`."""

    SHOWN = frozenset(["issuer", "client_id", "label", "scopes", "name_claim", "role_claim", "roles", "hours"])

    issuer: Annotated[str, Field(max_length=500)] | None = None
    """URL of the provider, exactly as it identifies itself. Its keys and endpoints are found below it."""
    client_id: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    """ID of this service at the provider."""
    client_secret: Path | None = None
    """File with the secret that the provider gave this service; None for a public client, which uses only PKCE."""
    label: Annotated[str, Field(min_length=1, max_length=60)] = "single sign-on"
    """Name of the provider on the page: "Sign in with …"."""
    scopes: tuple[Annotated[str, Field(pattern=r"^[\x21\x23-\x5b\x5d-\x7e]{1,100}$")], ...] = ("openid", "profile")
    """Requested scopes. `openid` is always included."""
    name_claim: Claim = "preferred_username"
    """Claim with a person's name at this service. Choose one that people cannot change."""
    role_claim: Claim = "groups"
    """Claim with a person's groups, one text or several."""
    roles: dict[Claim, Role] = {}
    """Role for each value of that claim; the highest one counts. People with none of them are not admitted."""
    hours: Annotated[float, Field(gt=0, le=720)] = 12.0
    """Time (h) after which people must sign in again. A role that the provider withdraws lasts until then."""

    @field_validator("issuer")
    @classmethod
    def _is_protected(cls, address: str | None) -> str | None:
        return protected(address)

    @field_validator("client_secret")
    @classmethod
    def _expanded(cls, file: Path | None) -> Path | None:
        return None if file is None else file.expanduser()

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        """Raises ValueError for a provider with incomplete settings."""
        if self.issuer is not None:
            for name in ("client_id", "roles"):
                if not getattr(self, name):
                    raise ValueError(f"{name} is missing, which an issuer needs")
        return self


def check(settings: Settings) -> None:
    """Raises SpecError if sign-in is configured but the service's own URL is not."""
    section = settings.section(OidcSettings)
    if section.issuer is not None:
        require_address(section, settings.server)


def require_address(section: OidcSettings, server: ServiceSettings) -> str:
    """Returns the URL of the service for browsers. Raises SpecError if it is not configured."""
    if server.address is None:
        raise SpecError(f"server.address is missing, which oidc.issuer {section.issuer} needs")
    return server.address
