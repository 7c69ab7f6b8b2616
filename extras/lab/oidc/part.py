"""Signing in to a running service."""

from __future__ import annotations

from daq.contracts.extras import require_extra
from extras.lab.oidc.settings import OidcSettings, require_address
from extras.lab.oidc.sign_in import SignIns
from server.parts import Part
from server.services import Services


class SigningIn(Part):
    """The provider, and people on their way to it; `provider` is None where the configuration names none."""

    def __init__(self, services: Services) -> None:
        """Raises SpecError, and MissingExtraError without Authlib."""
        self.settings = services.settings.section(OidcSettings)
        self.sign_ins = SignIns(services.clock)
        self.provider = None
        self.lets_people_in = self.settings.issuer is not None
        if self.lets_people_in:
            require_extra("oidc", "oidc", "authlib")
            from extras.lab.oidc.provider import open_provider

            address = require_address(self.settings, services.settings.server)
            self.provider = open_provider(self.settings, address)
