"""The configuration of notifications: recipients and kinds, by webhook or by e-mail. No request can change it."""

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
"""Most webhooks, and most people with e-mail: an assumption. Each has a thread."""
_ADDRESS = re.compile(r"[^\s@<>,;:\"\\()\[\]]+@[^\s@<>,;:\"\\()\[\]]+")


class WebhookSettings(FrozenRecord):
    """Table `[notifications.webhooks.NAME]`: a URL to which notifications are posted."""

    url: SecretStr
    """URL, `https://…`. It is not shown, since with many services its path is a secret."""
    secret: Path | None = None
    """File with the secret that signs the messages (`whsec_` and base64), as in Standard Webhooks."""
    about: tuple[NotificationKind, ...] = KINDS
    """Kinds of notification: `done`, `fault`, `attention`."""

    @field_validator("url")
    @classmethod
    def _is_address(cls, url: SecretStr) -> SecretStr:
        """Raises ValueError for an invalid URL, without repeating it."""
        try:
            parts = urlsplit(url.get_secret_value())
            port = parts.port
        except ValueError:
            raise ValueError("is not a URL; write https://host/path") from None
        if parts.scheme not in ("https", "http") or not parts.hostname or parts.fragment or port == 0:
            raise ValueError("is not a URL; write https://host/path")
        return url

    @field_validator("secret")
    @classmethod
    def _expanded(cls, file: Path | None) -> Path | None:
        return None if file is None else file.expanduser()

    @property
    def host(self) -> str:
        """The host of the URL."""
        return urlsplit(self.url.get_secret_value()).hostname or ""


class EmailSettings(FrozenRecord):
    """Table `[notifications.email.NAME]`: a person who gets notifications by e-mail."""

    to: Annotated[str, Field(max_length=254)]
    """E-mail address."""
    about: tuple[NotificationKind, ...] = ("fault", "attention")
    """Kinds of notification: `done`, `fault`, `attention`."""

    @field_validator("to")
    @classmethod
    def _is_address(cls, address: str) -> str:
        return require_mail_address(address)


class SmtpSettings(FrozenRecord):
    """Table `[notifications.smtp]`: the mail server that sends the e-mails."""

    host: Host
    """Name of the server."""
    port: Annotated[int, Field(ge=1, le=65535)] = 587
    """Port: 587 for `starttls`, 465 for `tls`."""
    tls: Literal["starttls", "tls", "none"] = "starttls"
    """Encryption of the connection. `none` sends everything in plain text, and no password."""
    ca: Path | None = None
    """File with the certificates to trust; None for the computer's."""
    user: Annotated[str, Field(max_length=254)] | None = None
    """User name at the server; None if it needs none."""
    password: Path | None = None
    """File with the password."""
    sender: Annotated[str, Field(max_length=254)]
    """Sender address of the e-mails."""

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
        """Raises ValueError for a password without a user name, or one that would be sent in plain text."""
        if (self.user is None) != (self.password is None):
            raise ValueError("user and password: give both, or neither")
        if self.password is not None and self.tls == "none":
            raise ValueError('a password needs encryption: tls = "starttls" or "tls"')
        return self


class NotificationSettings(Section):
    """Section `[notifications]`. Without a webhook or an e-mail table nobody is notified."""

    SHOWN = frozenset(["about", "host", "port", "sender", "tls", "to", "user"])

    webhooks: Annotated[dict[DestinationName, WebhookSettings], Field(max_length=MOST_DESTINATIONS)] = {}
    """Webhooks, by name."""
    email: Annotated[dict[DestinationName, EmailSettings], Field(max_length=MOST_DESTINATIONS)] = {}
    """People with e-mail, by name."""
    smtp: SmtpSettings | None = None
    """The mail server; needed for e-mail."""

    @model_validator(mode="after")
    def _is_complete(self) -> NotificationSettings:
        """Raises ValueError for e-mail without a server."""
        if self.email and self.smtp is None:
            raise ValueError("email needs the mail server: give [notifications.smtp] host and sender")
        return self

    def digested(self) -> dict[str, Any]:
        """Returns the same with the hosts of webhooks in place of their URLs."""
        return super().digested() | {"hosts": {name: webhook.host for name, webhook in self.webhooks.items()}}


def require_mail_address(address: str) -> str:
    """Returns an e-mail address. Raises ValueError for anything that may be more than one address."""
    if not address.isascii() or not address.isprintable() or _ADDRESS.fullmatch(address) is None:
        raise ValueError("is not an e-mail address; write name@host")
    return address
