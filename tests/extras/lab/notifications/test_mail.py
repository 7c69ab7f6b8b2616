"""E-mail, through a mail server that is not this project's (aiosmtpd)."""

import asyncio
import socket
import ssl
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from email import message_from_bytes, policy
from pathlib import Path
from typing import Any

import pytest
from aiosmtpd.smtp import SMTP, AuthResult, Envelope, LoginPassword, Session

from daq.contracts.service.notifications import Notification
from extras.lab.notifications.senders import DeliveryError, Mail, message_of
from extras.lab.notifications.settings import EmailSettings, SmtpSettings
from tests.daq_cli.test_hostile_names import NAMES
from tests.server.authority import Authority

NOW = datetime(2026, 3, 1, 8, tzinfo=UTC)
ANNA = EmailSettings(to="anna@lab.example")


class Handler:
    def __init__(self) -> None:
        self.taken: list[Envelope] = []
        self.answer = "250 taken"

    async def handle_DATA(  # noqa: N802 - its name is aiosmtpd's
        self, _server: SMTP, _session: Session, envelope: Envelope
    ) -> str:
        if self.answer.startswith("250"):
            self.taken.append(envelope)
        return self.answer


@contextmanager
def mail_server(ssl_context: ssl.SSLContext | None = None, **options: Any) -> Iterator[tuple[Handler, int]]:
    """Runs a mail server at a free port; with `ssl_context` it speaks TLS from the beginning."""
    handler, loop = Handler(), asyncio.new_event_loop()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        made = loop.create_server(lambda: SMTP(handler, loop=loop, **options), sock=listener, ssl=ssl_context)
        server = loop.run_until_complete(made)
        thread = threading.Thread(target=loop.run_forever)
        thread.start()
        try:
            yield handler, listener.getsockname()[1]
        finally:
            asyncio.run_coroutine_threadsafe(_end(server), loop).result()
            loop.call_soon_threadsafe(loop.stop)
            thread.join()
            loop.close()


async def _end(server: asyncio.Server) -> None:
    """Ends a server and its connections, whose clients may have gone without a word."""
    server.close()
    others = asyncio.all_tasks() - {asyncio.current_task()}
    for task in others:
        task.cancel()
    await asyncio.gather(*others, return_exceptions=True)
    await server.wait_closed()


def told(text: str = "the arm is at fault", robot: str = "ma2000") -> Any:
    return message_of(Notification(topic="arm.fault", kind="fault", at=NOW, text=text, robot=robot))


def smtp(port: int, **options: Any) -> SmtpSettings:
    return SmtpSettings(host="localhost", port=port, sender="arm@lab.example", **options)


def test_an_e_mail_says_what_has_happened_and_is_recognised_when_it_comes_twice() -> None:
    message = told("Gelenk 3: \u03b8 > limit\r\nBcc: everybody@lab.example")
    with mail_server() as (handler, port):
        for _ in range(2):
            assert Mail(ANNA, smtp(port, tls="none")).send(message) == "accepted by the mail server"
        first, second = (message_from_bytes(one.content or b"", policy=policy.default) for one in handler.taken)
        assert handler.taken[0].rcpt_tos == ["anna@lab.example"]
    assert (first["From"], first["To"]) == ("arm@lab.example", "anna@lab.example")
    assert first["Subject"] == "ma2000: FAULT (arm.fault)"
    assert first["Message-ID"] == second["Message-ID"] == f"<{message.id}@lab.example>"
    assert first["Auto-Submitted"] == "auto-generated"
    assert first["Bcc"] is None
    body = first.get_content()
    assert body.startswith("Gelenk 3: \u03b8 > limit")
    assert "2026-03-01 08:00:00 UTC" in body


@pytest.mark.parametrize("tls", ["starttls", "tls"])
def test_the_connection_is_encrypted_and_the_certificate_checked(tmp_path: Path, tls: str) -> None:
    authority = Authority(tmp_path, "localhost")
    options = {"ssl_context": authority.server()} if tls == "tls" else {"tls_context": authority.server()}
    with mail_server(**options, **({} if tls == "tls" else {"require_starttls": True})) as (handler, port):
        Mail(ANNA, smtp(port, tls=tls, ca=authority.file())).send(told())
        assert len(handler.taken) == 1
        with pytest.raises(DeliveryError, match="its certificate is not valid"):
            Mail(ANNA, smtp(port, tls=tls)).send(told())
        assert len(handler.taken) == 1


def accounts(users: Mapping[str, str], seen: list[tuple[bool, str, str]]) -> Callable[..., AuthResult]:
    """What a server asks about whoever gives a name and a password: whether they are right."""

    def check(_server: SMTP, session: Session, _envelope: Envelope, _kind: str, given: Any) -> AuthResult:
        assert isinstance(given, LoginPassword)
        seen.append((session.ssl is not None, given.login.decode(), given.password.decode()))
        return AuthResult(success=users.get(seen[-1][1]) == seen[-1][2], handled=False)

    return check


def test_a_password_is_given_after_the_connection_is_encrypted(tmp_path: Path) -> None:
    authority, seen, file = Authority(tmp_path, "localhost"), list[tuple[bool, str, str]](), tmp_path / "password"
    check = accounts({"arm": "right"}, seen)
    options = {"tls_context": authority.server(), "authenticator": check, "auth_required": True}
    with mail_server(**options) as (handler, port):
        settings = smtp(port, ca=authority.file(), user="arm", password=file)
        file.write_text("right\n", "utf-8")
        Mail(ANNA, settings).send(told())
        assert len(handler.taken) == 1
        for password, line in (("wrong", "localhost: answered 535"), ("schlüßel", "must be of ASCII letters")):
            file.write_text(f"{password}\n", "utf-8")
            with pytest.raises(DeliveryError, match=line) as refused:
                Mail(ANNA, settings).send(told())
            assert password not in str(refused.value)
        assert len(handler.taken) == 1
    assert (True, "arm", "right") in seen
    assert all(encrypted for encrypted, _, _ in seen)


def test_a_server_that_has_no_tls_refuses_or_is_away_is_told_in_no_words_of_its_own() -> None:
    with mail_server() as (handler, port):
        with pytest.raises(DeliveryError, match="does not support what the configuration needs"):
            Mail(ANNA, smtp(port)).send(told())
        handler.answer = "451 the secret words"
        with pytest.raises(DeliveryError, match=r"^localhost: answered 451$"):
            Mail(ANNA, smtp(port, tls="none")).send(told())
        assert handler.taken == []
    with pytest.raises(DeliveryError, match=r"localhost: Connection refused"):
        Mail(ANNA, smtp(port, tls="none")).send(told())


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"user": "arm"}, "give both, or neither"),
        ({"user": "arm", "password": "file", "tls": "none"}, "a password needs encryption"),
        ({"sender": "arm@lab.example\r\nBcc: x@y"}, "is not an e-mail address"),
        ({"sender": "a@b, c@d"}, "is not an e-mail address"),
    ],
)
def test_what_cannot_be_configured(changes: dict[str, Any], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        SmtpSettings(**{"host": "mail.lab", "sender": "arm@lab.example", **changes})


@NAMES
def test_in_an_e_mail(name: str) -> None:
    now = datetime(2026, 3, 1, 8, tzinfo=UTC)
    told = Notification(kind="fault", topic="arm.fault", at=now, text=name, robot=name)
    mail = Mail(EmailSettings(to="anna@lab.example"), SmtpSettings(host="localhost", port=25, sender="daq@lab.example"))
    written = mail._written(message_of(told))
    read = message_from_bytes(written.as_bytes(policy=policy.SMTP), policy=policy.default)
    assert read["Bcc"] is None
    assert str(read["Subject"]).endswith(": FAULT (arm.fault)")
    assert read.get_content().splitlines()[: name.count("\n") + 1] == name.splitlines()
    assert read.get_content_type() == "text/plain"
