"""The configuration of notifications: who is told what, by webhook or by e-mail. No request can change it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Literal
from urllib.parse import urlsplit

from pydantic import Field, SecretStr, field_validator, model_validator

from daq.config.section import Section
from daq.contracts.frozen import FrozenRecord
from daq.contracts.service.notifications import KINDS, NotificationKind

DestinationName = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,31}$")]
Host = Annotated[str, Field(min_length=1, max_length=253, pattern=r"^[A-Za-z0-9.:_-]+$")]
MOST_DESTINATIONS = 16
"""Largest number of webhooks, and of people with e-mail: an assumption. Each has a thread."""
_ADDRESS = re.compile(r"[^\s@<>,;:\"\\()\[\]]+@[^\s@<>,;:\"\\()\[\]]+")


class WebhookSettings(FrozenRecord):
    """Table `[notifications.webhooks.NAME]`: an address to which notifications are posted."""

    url: SecretStr
    """Address, `https://…`. It is not shown, since with many services its path is a secret."""
    secret: Path
    """File with the secret that signs the messages (`whsec_` and base64), as Standard Webhooks has it."""
    about: tuple[NotificationKind, ...] = KINDS
    """What is told: `done`, `fault`, `attention`."""

    @field_validator("url")
    @classmethod
    def _is_address(cls, url: SecretStr) -> SecretStr:
        """Raises ValueError for what is no address, without repeating it."""
        try:
            parts = urlsplit(url.get_secret_value())
            port = parts.port
        except ValueError:
            raise ValueError("is no address; write https://host/path") from None
        if parts.scheme not in ("https", "http") or not parts.hostname or parts.fragment or port == 0:
            raise ValueError("is no address; write https://host/path")
        if parts.username is not None or parts.password is not None:
            raise ValueError("has a user name or password in it; messages are signed instead")
        return url

    @field_validator("secret")
    @classmethod
    def _expanded(cls, file: Path) -> Path:
        return file.expanduser()

    @property
    def host(self) -> str:
        """The host of the address."""
        return urlsplit(self.url.get_secret_value()).hostname or ""


class EmailSettings(FrozenRecord):
    """Table `[notifications.email.NAME]`: a person who gets notifications by e-mail."""

    to: Annotated[str, Field(max_length=254)]
    """Their address."""
    about: tuple[NotificationKind, ...] = ("fault", "attention")
    """What they are told: `done`, `fault`, `attention`."""

    @field_validator("to")
    @classmethod
    def _is_address(cls, address: str) -> str:
        return require_mail_address(address)


class SmtpSettings(FrozenRecord):
    """Table `[notifications.smtp]`: the mail server that takes the e-mails."""

    host: Host
    """Name of the server."""
    port: Annotated[int, Field(ge=1, le=65535)] = 587
    """Port: 587 for `starttls`, 465 for `tls`."""
    tls: Literal["starttls", "tls", "none"] = "starttls"
    """How the connection is encrypted. `none` sends everything as it is, and no password."""
    ca: Path | None = None
    """File with the certificates to trust; None for those of the computer."""
    user: Annotated[str, Field(max_length=254)] | None = None
    """Name at the server; None if it asks for none."""
    password: Path | None = None
    """File with the password."""
    sender: Annotated[str, Field(max_length=254)]
    """Address from which the e-mails come."""

    @field_validator("sender")
    @classmethod
    def _is_address(cls, address: str) -> str:
        return require_mail_address(address)

    @field_validator("ca", "password")
    @classmethod
    def _expanded(cls, file: Path | None) -> Path | None:
        return None if file is None else file.expanduser()

    @model_validator(mode="after")
    def _password_is_safe(self) -> SmtpSettings:
        """Raises ValueError for a password without a name, or one that everybody on the way could read."""
        if (self.user is None) != (self.password is None):
            raise ValueError("user and password: give both, or neither")
        if self.password is not None and self.tls == "none":
            raise ValueError('a password needs encryption: tls = "starttls" or "tls"')
        return self


class NotificationSettings(Section):
    """Section `[notifications]`. Without a table of a webhook or an e-mail nobody is told anything."""

    SHOWN = frozenset(["about", "attempts", "host", "port", "sender", "tls", "to", "user"])

    webhooks: Annotated[dict[DestinationName, WebhookSettings], Field(max_length=MOST_DESTINATIONS)] = {}
    """Webhooks, by name."""
    email: Annotated[dict[DestinationName, EmailSettings], Field(max_length=MOST_DESTINATIONS)] = {}
    """People with e-mail, by name."""
    smtp: SmtpSettings | None = None
    """The mail server; needed for e-mail."""
    private_hosts: tuple[Host, ...] = ()
    """Hosts of webhooks that may have private addresses (10.…, 192.168.…, this computer), and plain `http`. All others
    must be public, and are refused if their name leads to a private address."""
    attempts: Annotated[int, Field(ge=1, le=12)] = 10
    """Number of attempts after which a message is given up: 10 take two days."""

    @model_validator(mode="after")
    def _is_complete(self) -> NotificationSettings:
        """Raises ValueError for e-mail without a server, and for plain `http` to a host that is not listed."""
        if self.email and self.smtp is None:
            raise ValueError("email needs the mail server: give [notifications.smtp] host and sender")
        for name, webhook in self.webhooks.items():
            plain = urlsplit(webhook.url.get_secret_value()).scheme == "http"
            if plain and webhook.host not in {host.lower() for host in self.private_hosts}:
                raise ValueError(f"webhooks.{name}.url: http is allowed to private_hosts only; write https")
        return self

    def digested(self) -> dict[str, Any]:
        """Returns the same, with the hosts of webhooks, whose addresses are not shown."""
        return super().digested() | {"hosts": {name: webhook.host for name, webhook in self.webhooks.items()}}


def require_mail_address(address: str) -> str:
    """Returns an address of e-mail. Raises ValueError for anything that could be more than one address."""
    if not address.isascii() or not address.isprintable() or _ADDRESS.fullmatch(address) is None:
        raise ValueError("is no address of e-mail; write name@host")
    return address
