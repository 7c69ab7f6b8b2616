"""Delivers one message: to a webhook, signed by "Standard Webhooks" 1.0 (https://www.standardwebhooks.com), or by
e-mail through a mail server with TLS (RFC 3207, RFC 8314)."""

from __future__ import annotations

import base64
import binascii
import hashlib
import hmac
import secrets
import smtplib
import ssl
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from email.message import EmailMessage
from email.utils import format_datetime
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import httpx

from daq.contracts.documents import read_text
from daq.contracts.errors import DaqError, SpecError
from daq.contracts.exit_codes import NOT_REACHED
from daq.contracts.service.base import Wire
from daq.contracts.service.notifications import Notification, NotificationKind
from extras.lab.notifications.settings import EmailSettings, NotificationSettings, SmtpSettings, WebhookSettings

WITHIN = 20.0
"""Time (s) for an answer of a webhook or a mail server."""
SECRET_PREFIX = "whsec_"
SHORTEST_SECRET, LONGEST_SECRET = 24, 64
"""Sizes (bytes) of a secret, as the specification requires."""
SUBJECTS = {"done": "done", "fault": "FAULT", "attention": "please look"}


class DeliveryError(DaqError):
    """A message was not delivered. The text names the host and never repeats an answer's words."""

    exit_code = NOT_REACHED


class Posted(Wire):
    """The body of a webhook's message, as the specification has it."""

    type: str
    timestamp: str
    data: Notification


@dataclass(frozen=True)
class Message:
    """A notification on its way. `id`: the same at each attempt, so that a receiver recognises repeated messages."""

    id: str
    told: Notification

    @property
    def payload(self) -> str:
        """The signed and posted text, JSON."""
        at = self.told.at.isoformat(timespec="milliseconds")
        return Posted(type=self.told.topic, timestamp=at, data=self.told).model_dump_json()


def message_of(notification: Notification) -> Message:
    """Returns the message of a notification, with a new ID."""
    return Message(f"msg_{secrets.token_hex(12)}", notification)


@dataclass(frozen=True)
class Destination:
    """A webhook, or a person with e-mail. `host`: the server, for people. `send` delivers a message, returns the answer
    in a few words of this program, and raises DeliveryError."""

    channel: Literal["webhook", "email"]
    name: str
    host: str
    about: tuple[NotificationKind, ...]
    send: Callable[[Message], str]

    @property
    def key(self) -> str:
        """Its name in the log and in metrics."""
        return f"{self.channel} {self.name}"


def destinations_of(settings: NotificationSettings) -> list[Destination]:
    """Returns all destinations. Raises SpecError for a file of a secret that cannot be used."""
    found = [
        Destination("webhook", name, one.host, one.about, Webhook(one).send) for name, one in settings.webhooks.items()
    ]
    if (smtp := settings.smtp) is not None:
        people = settings.email.items()
        found += [Destination("email", name, smtp.host, one.about, Mail(one, smtp).send) for name, one in people]
    return found


def problem_of(error: Exception) -> str:
    """Returns one line on why a message was not delivered. For an unexpected error it states only the type, since its
    text may contain a secret."""
    if isinstance(error, DeliveryError):
        return str(error)
    return f"not sent: {type(error).__name__}, a fault of this program"


def load_secret(file: Path) -> bytes:
    """Reads a secret. Raises SpecError, without repeating any of it."""
    what = f"notifications: secret {file}"
    text = read_text(file, what).strip()
    try:
        secret = base64.b64decode(text.removeprefix(SECRET_PREFIX), validate=True)
    except (binascii.Error, ValueError):
        secret = b""
    if not text.startswith(SECRET_PREFIX) or not SHORTEST_SECRET <= len(secret) <= LONGEST_SECRET:
        raise SpecError(f"{what}: write {SECRET_PREFIX} and {SHORTEST_SECRET} to {LONGEST_SECRET} bytes as base64")
    return secret


class Webhook:
    """One webhook. Redirects are not followed, and the certificate must be that of the host."""

    def __init__(self, settings: WebhookSettings, within: float = WITHIN) -> None:
        self._url = settings.url.get_secret_value()
        self._host = settings.host
        self._secret = None if settings.secret is None else load_secret(settings.secret)
        self._within = within

    def send(self, message: Message) -> str:
        """Posts a message. Returns the status of the answer. Raises DeliveryError."""
        payload = message.payload
        headers = {"Content-Type": "application/json", "User-Agent": f"ma2000-daq/{version('ma2000-daq')}"}
        headers |= self._signed(message.id, payload)
        try:
            # The body of the answer may be endless, and is not read.
            with httpx.stream("POST", self._url, content=payload, headers=headers, timeout=self._within) as answer:
                status = answer.status_code
        except httpx.TimeoutException as error:
            raise DeliveryError(f"{self._host}: no answer within {self._within:g} s") from error
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise DeliveryError(f"{self._host}: cannot be connected to: {type(error).__name__}") from error
        if not 200 <= status < 300:
            raise DeliveryError(f"{self._host}: answered {status}")
        return f"answered {status}"

    def _signed(self, identity: str, payload: str) -> dict[str, str]:
        """Returns the headers of the specification; `webhook-signature` is the HMAC-SHA256 of ID, time (s since 1970)
        and payload."""
        timestamp = int(datetime.now(UTC).timestamp())
        headers = {"webhook-id": identity, "webhook-timestamp": str(timestamp)}
        if self._secret is not None:
            digest = hmac.digest(self._secret, f"{identity}.{timestamp}.{payload}".encode(), hashlib.sha256)
            headers["webhook-signature"] = f"v1,{base64.b64encode(digest).decode()}"
        return headers


class Mail:
    """One person's e-mail."""

    def __init__(self, settings: EmailSettings, smtp: SmtpSettings) -> None:
        self._to = settings.to
        self._smtp = smtp
        try:
            self._trust = ssl.create_default_context(cafile=None if smtp.ca is None else str(smtp.ca))
        except OSError as error:  # ssl.SSLError is an OSError, too
            raise SpecError(f"notifications.smtp.ca {smtp.ca}: cannot be read, or has no certificate") from error
        file = smtp.password
        self._password = None if file is None else read_text(file, f"notifications.smtp.password {file}").strip()

    def send(self, message: Message) -> str:
        """Sends the message. Returns a text for the log. Raises DeliveryError."""
        host = self._smtp.host
        try:
            with self._connected() as server:
                if self._smtp.tls == "starttls":
                    server.starttls(context=self._trust)
                if self._smtp.user is not None and self._password is not None:
                    server.login(self._smtp.user, self._password)
                server.send_message(self._written(message), self._smtp.sender, [self._to])
        except smtplib.SMTPRecipientsRefused as error:
            codes = ", ".join(str(code) for code, _ in error.recipients.values())
            raise DeliveryError(f"{host}: refused the recipient ({codes})") from error
        except smtplib.SMTPNotSupportedError as error:
            line = f"{host}: does not support what the configuration needs (TLS, or a password)"
            raise DeliveryError(line) from error
        except smtplib.SMTPResponseException as error:
            raise DeliveryError(f"{host}: answered {error.smtp_code}") from error
        except UnicodeEncodeError:  # raised from None: its text has the password
            raise DeliveryError(f"{host}: user and password must be of ASCII letters") from None
        except ssl.SSLError as error:
            raise DeliveryError(f"{host}: its certificate is not valid, or it does not speak TLS") from error
        except TimeoutError as error:
            raise DeliveryError(f"{host}: no answer within {WITHIN:g} s") from error
        except (OSError, smtplib.SMTPException) as error:
            raise DeliveryError(f"{host}: {getattr(error, 'strerror', None) or 'the connection failed'}") from error
        return "accepted by the mail server"

    def _connected(self) -> smtplib.SMTP:
        host, port = self._smtp.host, self._smtp.port
        if self._smtp.tls == "tls":
            return smtplib.SMTP_SSL(host, port, timeout=WITHIN, context=self._trust)
        return smtplib.SMTP(host, port, timeout=WITHIN)

    def _written(self, message: Message) -> EmailMessage:
        """Returns the e-mail. Headers contain only text of this program and printable characters, to prevent header
        injection."""
        told = message.told
        mail = EmailMessage()
        mail["From"], mail["To"] = self._smtp.sender, self._to
        robot = "".join(character if character.isprintable() else " " for character in told.robot or "MA2000 DAQ")
        mail["Subject"] = f"{robot}: {SUBJECTS[told.kind]} ({told.topic})"
        mail["Date"] = format_datetime(told.at)
        mail["Message-ID"] = f"<{message.id}@{self._smtp.sender.rpartition('@')[2]}>"
        mail["Auto-Submitted"] = "auto-generated"  # RFC 3834: suppresses auto-replies
        lines = [told.text, "", f"at {told.at:%Y-%m-%d %H:%M:%S %Z}"]
        lines += [f"{name} {value}" for name in ("experiment", "job") if (value := getattr(told, name)) is not None]
        mail.set_content("\n".join(lines) + "\n")
        return mail
