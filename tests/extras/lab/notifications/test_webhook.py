"""Webhooks: signed so that another's library accepts them; what receivers do is one line of this program's words."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from standardwebhooks import Webhook as Witness
from standardwebhooks import WebhookVerificationError

from daq.config.settings import load_settings
from daq.contracts.errors import SpecError
from daq.contracts.service.notifications import Notification
from extras.lab.notifications.senders import DeliveryError, Webhook, load_secret, message_of
from extras.lab.notifications.settings import WebhookSettings
from tests.extras.lab.notifications.receivers import SECRET, receiver, secret_file
from tests.server.authority import Authority

NOW = datetime(2026, 3, 1, 8, tzinfo=UTC)
MESSAGE = message_of(Notification(topic="test", kind="attention", at=NOW, text="späte Stunde", robot="ma2000"))


def made(folder: Path, url: str, **options: Any) -> Webhook:
    return Webhook(WebhookSettings(url=url, secret=secret_file(folder)), **options)


def test_another_library_accepts_the_signature_and_no_other_body(tmp_path: Path) -> None:
    with receiver() as there:
        assert made(tmp_path, f"http://127.0.0.1:{there.port}/in?a=b").send(MESSAGE) == "answered 204"
        (posted,) = there.posted
        Webhook(WebhookSettings(url=f"http://127.0.0.1:{there.port}/")).send(MESSAGE)
        assert "webhook-signature" not in there.posted[1].headers
    assert posted.path == "/in?a=b"
    told: Any = Witness(SECRET).verify(posted.body, posted.headers)
    assert (told["type"], told["data"]["text"]) == ("test", "späte Stunde")
    with pytest.raises(WebhookVerificationError):
        Witness(SECRET).verify(posted.body + b" ", posted.headers)
    with pytest.raises(WebhookVerificationError):
        Witness(SECRET).verify(posted.body, posted.headers | {"webhook-id": "msg_other"})


@contextmanager
def endless_answer(listener: socket.socket) -> Iterator[None]:
    """Answers one request with a 500 whose body never ends."""

    def answer() -> None:
        connection, _ = listener.accept()
        with connection, suppress(OSError):
            connection.recv(65536)
            connection.sendall(b"HTTP/1.1 500 the secret\r\nTransfer-Encoding: chunked\r\n\r\n")
            while True:
                connection.sendall(b"6\r\nsecret\r\n")

    thread = threading.Thread(target=answer)
    thread.start()
    yield
    thread.join()


def test_what_a_receiver_does_is_told_in_no_words_of_its_own(tmp_path: Path) -> None:
    with receiver() as there:
        there.answers = [(302, {"Location": f"http://127.0.0.1:{there.port}/elsewhere"})]
        with pytest.raises(DeliveryError, match=r"^127\.0\.0\.1: answered 302$"):
            made(tmp_path, f"http://127.0.0.1:{there.port}/").send(MESSAGE)
        assert len(there.posted) == 1
    with socket.create_server(("127.0.0.1", 0)) as listener, endless_answer(listener):
        url = f"http://127.0.0.1:{listener.getsockname()[1]}/"
        with pytest.raises(DeliveryError, match=r"^127\.0\.0\.1: answered 500$"):
            made(tmp_path, url).send(MESSAGE)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"http://127.0.0.1:{listener.getsockname()[1]}/"
        with pytest.raises(DeliveryError, match=r"127.0.0.1: no answer within 0.2 s"):
            made(tmp_path, url, within=0.2).send(MESSAGE)
    with receiver(Authority(tmp_path, "localhost").server()) as there:  # not trusted by this computer
        with pytest.raises(DeliveryError, match="localhost: cannot be connected to"):
            made(tmp_path, f"https://localhost:{there.port}/").send(MESSAGE)
        assert there.posted == []


@pytest.mark.parametrize("url", ["ftp://hooks.example/", "hooks.example", "https://", "https://hooks.example:99999/"])
def test_a_wrong_address_is_refused_and_not_repeated(tmp_path: Path, url: str) -> None:
    file = tmp_path / "daq.toml"
    file.write_text(f'[notifications.webhooks.lab]\nurl = "{url}"\n', "utf-8")
    with pytest.raises(SpecError, match=r"notifications\.webhooks\.lab\.url: is not a URL") as refused:
        load_settings(file)
    assert "hooks" not in str(refused.value).replace("webhooks", "")


@pytest.mark.parametrize("text", ["", "whsec_", "hush", "whsec_c2hvcnQ=", f"whsec_{'A' * 100}", "whsec_ÄÖ"])
def test_a_wrong_secret_is_refused_and_not_repeated(tmp_path: Path, text: str) -> None:
    file = tmp_path / "secret"
    file.write_text(text, "utf-8")
    with pytest.raises(SpecError) as refused:
        load_secret(file)
    assert not text or text not in str(refused.value).replace("write whsec_", "")
