"""Sends messages by e-mail, through a mail server with TLS (RFC 3207, RFC 8314)."""

from __future__ import annotations

import json
import smtplib
import ssl
from base64 import b64encode
from email.message import EmailMessage
from email.utils import format_datetime

from daq.contracts.documents import read_text
from daq.contracts.errors import SpecError
from daq.contracts.service.notifications import Notification
from extras.lab.notifications.delivery import DeliveryError, Message
from extras.lab.notifications.settings import EmailSettings, SmtpSettings

WITHIN = 20.0
"""Time (s) for one answer of the mail server."""
LOGGED_IN = 235
"""Answer of a mail server to a correct password (RFC 4954)."""
SUBJECTS = {"done": "done", "fault": "FAULT", "attention": "please look"}


class Mail:
    """One person's e-mail."""

    def __init__(self, settings: EmailSettings, smtp: SmtpSettings, within: float = WITHIN) -> None:
        self._to = settings.to
        self._smtp = smtp
        self._within = within
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
                    self._log_in(server, self._smtp.user, self._password)
                server.send_message(self._written(message), self._smtp.sender, [self._to])
        except smtplib.SMTPRecipientsRefused as error:
            codes = ", ".join(str(code) for code, _ in error.recipients.values())
            raise DeliveryError(f"{host}: refused the recipient ({codes})") from error
        except smtplib.SMTPNotSupportedError as error:
            raise DeliveryError(
                f"{host}: does not support what the configuration needs (TLS, or a password)"
            ) from error
        except smtplib.SMTPResponseException as error:
            raise DeliveryError(f"{host}: answered {error.smtp_code}") from error
        except ssl.SSLError as error:
            raise DeliveryError(f"{host}: its certificate is not valid, or it does not speak TLS") from error
        except TimeoutError as error:
            raise DeliveryError(f"{host}: no answer within {self._within:g} s") from error
        except (OSError, smtplib.SMTPException) as error:
            raise DeliveryError(f"{host}: {getattr(error, 'strerror', None) or 'the connection failed'}") from error
        return "accepted by the mail server"

    def _connected(self) -> smtplib.SMTP:
        host, port = self._smtp.host, self._smtp.port
        if self._smtp.tls == "tls":
            return smtplib.SMTP_SSL(host, port, timeout=self._within, context=self._trust)
        return smtplib.SMTP(host, port, timeout=self._within)

    def _log_in(self, server: smtplib.SMTP, user: str, password: str) -> None:
        """Logs in. smtplib handles ASCII only; other credentials are sent by AUTH PLAIN in UTF-8 (RFC 4616)."""
        if (user + password).isascii():
            server.login(user, password)
            return
        server.ehlo_or_helo_if_needed()
        if "PLAIN" not in server.esmtp_features.get("auth", "").upper().split():
            raise DeliveryError(
                f"{self._smtp.host}: accepts only a user and password of ASCII letters, since it has no AUTH PLAIN"
            )
        given = b64encode(f"\0{user}\0{password}".encode()).decode()
        code, text = server.docmd("AUTH", f"PLAIN {given}")
        if code != LOGGED_IN:
            raise smtplib.SMTPAuthenticationError(code, text)

    def _written(self, message: Message) -> EmailMessage:
        """Returns the e-mail. Headers contain only text of this program and printable characters, to prevent header
        injection."""
        told = Notification.model_validate(json.loads(message.payload)["data"])
        mail = EmailMessage()
        mail["From"], mail["To"] = self._smtp.sender, self._to
        robot = "".join(character if character.isprintable() else " " for character in told.robot or "MA2000 DAQ")
        mail["Subject"] = f"{robot}: {SUBJECTS[told.kind]} ({told.topic})"
        mail["Date"] = format_datetime(message.created)
        mail["Message-ID"] = f"<{message.id}@{self._smtp.sender.rpartition('@')[2]}>"
        mail["Auto-Submitted"] = "auto-generated"  # RFC 3834: suppresses auto-replies
        lines = [told.text, "", f"at {told.at:%Y-%m-%d %H:%M:%S %Z}"]
        lines += [f"{name} {value}" for name in ("experiment", "job") if (value := getattr(told, name)) is not None]
        mail.set_content("\n".join(lines) + "\n")
        return mail
