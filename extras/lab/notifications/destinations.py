"""The destinations of the configuration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from daq.contracts.service.notifications import NotificationKind
from extras.lab.notifications.delivery import Sender
from extras.lab.notifications.mail import Mail
from extras.lab.notifications.settings import NotificationSettings


@dataclass(frozen=True)
class Destination:
    """A webhook, or a person with e-mail. `host`: the server, for people."""

    channel: Literal["webhook", "email"]
    name: str
    host: str
    about: tuple[NotificationKind, ...]
    sender: Sender

    @property
    def key(self) -> str:
        """The name of its rows in the outbox."""
        return f"{self.channel} {self.name}"


def destinations_of(settings: NotificationSettings) -> list[Destination]:
    """Returns all destinations. Raises SpecError for a file of a secret that cannot be used."""
    found = []
    if settings.webhooks:
        from extras.lab.notifications.webhook import Webhook  # imports an HTTP client, which nothing else here needs

        for name, one in settings.webhooks.items():
            sender = Webhook(one, private_hosts=settings.private_hosts)
            found.append(Destination("webhook", name, one.host, one.about, sender))
    if settings.smtp is not None:
        smtp = settings.smtp
        found += [
            Destination("email", name, smtp.host, one.about, Mail(one, smtp)) for name, one in settings.email.items()
        ]
    return found
