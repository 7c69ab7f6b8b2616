"""Webhooks: signed so that another's library accepts them, and only to addresses that are allowed."""

import ipaddress
import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from standardwebhooks import Webhook as Witness
from standardwebhooks import WebhookVerificationError

from daq.config.settings import load_settings
from daq.contracts.errors import SpecError
from daq.contracts.service.notifications import Notification
from extras.lab.notifications.delivery import DeliveryError
from extras.lab.notifications.service import message_of
from extras.lab.notifications.settings import WebhookSettings
from extras.lab.notifications.webhook import (
    RefusedAddressError,
    Webhook,
    addresses_of,
    load_secret,
    resolve,
    signature_of,
    why_refused,
)
from tests.extras.lab.notifications.receivers import SECRET, receiver, secret_file
from tests.server.authority import Authority

NOW = datetime(2026, 3, 1, 8, tzinfo=UTC)
MESSAGE = message_of(Notification(topic="test", kind="attention", at=NOW, text="späte Stunde", robot="ma2000"))
HOST = "hooks.example"


def made(folder: Path, url: str, **options: Any) -> Webhook:
    return Webhook(WebhookSettings(url=url, secret=secret_file(folder)), **options)


def test_another_library_accepts_the_signature_and_no_other_body(tmp_path: Path) -> None:
    with receiver() as there:
        webhook = made(tmp_path, f"http://127.0.0.1:{there.port}/in?a=b", private_hosts=("127.0.0.1",))
        assert webhook.send(MESSAGE) == "answered 204"
        (posted,) = there.posted
    assert posted.path == "/in?a=b"
    told: Any = Witness(SECRET).verify(posted.body, posted.headers)
    assert told["type"] == "test"
    assert told["data"]["text"] == "späte Stunde"
    assert told == json.loads(posted.body)
    with pytest.raises(WebhookVerificationError):
        Witness(SECRET).verify(posted.body + b" ", posted.headers)
    with pytest.raises(WebhookVerificationError):
        Witness(SECRET).verify(posted.body, posted.headers | {"webhook-id": "msg_other"})


@given(st.binary(min_size=24, max_size=64), st.text("abc_019", min_size=1), st.datetimes(), st.text())
def test_signatures_are_those_of_another_library(secret: bytes, identity: str, moment: datetime, payload: str) -> None:
    payload = payload.encode("utf-8", "replace").decode()
    moment = moment.replace(tzinfo=UTC)
    expected = Witness(secret).sign(identity, moment, payload)
    assert signature_of(secret, identity, int(moment.timestamp() // 1), payload) == expected


def test_the_connection_goes_to_the_address_that_was_checked_and_the_certificate_is_that_of_the_name(
    tmp_path: Path,
) -> None:
    authority, asked = Authority(tmp_path, HOST), []

    def changes(host: str, port: int) -> list[str]:
        """Leads to this computer once, and then elsewhere (DNS rebinding)."""
        asked.append((host, port))
        return ["127.0.0.1"] if len(asked) == 1 else ["203.0.113.1"]

    with receiver(authority.server()) as there:
        url = f"https://{HOST}:{there.port}/in"
        options: dict[str, Any] = {"private_hosts": (HOST,), "resolver": changes}
        assert made(tmp_path, url, trust=authority.client(), **options).send(MESSAGE) == "answered 204"
        assert asked == [(HOST, there.port)]
        assert there.posted[0].headers["host"] == f"{HOST}:{there.port}"
        asked.clear()
        with pytest.raises(DeliveryError, match="certificate is not valid"):
            made(tmp_path, url, **options).send(MESSAGE)  # the computer does not trust the test's authority
        other = f"https://other.example:{there.port}/"
        asked.clear()
        with pytest.raises(DeliveryError, match="certificate is not valid"):
            made(tmp_path, other, trust=authority.client(), resolver=changes, private_hosts=("other.example",)).send(
                MESSAGE
            )
        assert len(there.posted) == 1


def test_a_name_that_leads_to_a_private_address_is_refused_before_anything_is_sent(tmp_path: Path) -> None:
    with receiver() as there:
        for addresses in (["127.0.0.1"], ["93.184.215.14", "127.0.0.1"], ["::1"], ["::ffff:127.0.0.1"]):
            webhook = made(tmp_path, f"https://{HOST}:{there.port}/", resolver=lambda *_, a=addresses: a)
            with pytest.raises(RefusedAddressError, match=f"{HOST}: it leads to"):
                webhook.send(MESSAGE)
        assert there.posted == []


def test_a_redirect_is_not_followed(tmp_path: Path) -> None:
    with receiver() as there:
        there.answers = [(302, {"Location": f"http://127.0.0.1:{there.port}/elsewhere"})]
        with pytest.raises(DeliveryError, match="answered 302, which leads elsewhere and is not followed"):
            made(tmp_path, f"http://127.0.0.1:{there.port}/", private_hosts=("127.0.0.1",)).send(MESSAGE)
        assert len(there.posted) == 1


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


def test_an_endless_answer_is_not_read_and_its_words_are_not_repeated(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener, endless_answer(listener):
        url = f"http://127.0.0.1:{listener.getsockname()[1]}/"
        with pytest.raises(DeliveryError) as refused:
            made(tmp_path, url, private_hosts=("127.0.0.1",)).send(MESSAGE)
    assert str(refused.value) == "127.0.0.1: answered 500"


def test_a_receiver_that_never_answers_ends_the_attempt(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"http://127.0.0.1:{listener.getsockname()[1]}/"
        with pytest.raises(DeliveryError, match=r"127.0.0.1: no answer within 0.2 s"):
            made(tmp_path, url, private_hosts=("127.0.0.1",), within=0.2).send(MESSAGE)


def test_gone_is_for_good_and_a_pause_that_is_asked_for_is_kept(tmp_path: Path) -> None:
    with receiver() as there:
        webhook = made(tmp_path, f"http://127.0.0.1:{there.port}/", private_hosts=("127.0.0.1",))
        there.answers = [(410, {}), (503, {"Retry-After": "120"}), (503, {"Retry-After": "Fri, 31 Dec 1999"})]
        errors = []
        for _ in range(3):
            with pytest.raises(DeliveryError) as refused:
                webhook.send(MESSAGE)
            errors.append((refused.value.for_good, refused.value.retry_after))
    assert errors == [(True, None), (False, 120.0), (False, None)]


# ---- addresses

PRIVATE = tuple(
    ipaddress.ip_network(text)
    for text in (
        *("0.0.0.0/8", "10.0.0.0/8", "100.64.0.0/10", "127.0.0.0/8", "169.254.0.0/16", "172.16.0.0/12", "192.0.0.0/24"),
        *("192.0.2.0/24", "192.168.0.0/16", "198.18.0.0/15", "198.51.100.0/24", "203.0.113.0/24", "240.0.0.0/4"),
        *("::1", "::", "::ffff:0:0/96", "64:ff9b:1::/48", "100::/64", "2001::/23", "2001:db8::/32", "2002::/16"),
        *("3fff::/20", "fc00::/7", "fe80::/10"),
    )
)
EXCEPT = tuple(
    ipaddress.ip_network(text)
    for text in (
        *("192.0.0.9", "192.0.0.10", "2001:1::1", "2001:1::2", "2001:3::/32", "2001:4:112::/48", "2001:20::/28"),
        "2001:30::/28",
    )
)
"""The networks that `ipaddress` of CPython 3.13.1 calls private, and its exceptions; older ones have fewer."""


def is_private(address: ipaddress.IPv4Address | ipaddress.IPv6Address) -> bool:
    return any(address in n for n in PRIVATE) and not any(address in n for n in EXCEPT)


private_addresses = st.sampled_from([n for n in PRIVATE if n.version == 4]).flatmap(
    lambda n: st.ip_addresses(network=str(n)).filter(is_private)
)


def forms(address: ipaddress.IPv4Address) -> list[str]:
    """The texts that a resolver takes for an address: decimal, octal, hexadecimal, and of fewer parts."""
    number, parts = int(address), list(address.packed)
    return [
        str(number),
        hex(number),
        f"0{number:o}",
        ".".join(map(hex, parts)),
        ".".join(f"0{part:o}" for part in parts),
        f"{parts[0]}.{number & 0xFFFFFF}",
        f"{parts[0]}.{parts[1]}.{number & 0xFFFF}",
    ]


@given(private_addresses, st.integers(0, 6))
def test_a_private_address_is_refused_in_whatever_form_it_is_written(address: ipaddress.IPv4Address, form: int) -> None:
    """By the computer's own resolver, which understands these forms."""
    with pytest.raises(DeliveryError):
        addresses_of(forms(address)[form], 443, listed=False, resolver=resolve)


@given(private_addresses, st.sampled_from(["::ffff:0:0", "::", "64:ff9b::", "64:ff9b:1::", "fe80::", "fec0::"]))
def test_a_private_address_is_refused_inside_an_address_of_version_6(
    address: ipaddress.IPv4Address, prefix: str
) -> None:
    inside = ipaddress.IPv6Address(int(ipaddress.IPv6Address(prefix)) | int(address))
    assert why_refused(inside)
    for outer in (0x2002 << 112 | int(address) << 80, 0x20010000 << 96 | (int(address) ^ 0xFFFFFFFF)):
        assert why_refused(ipaddress.IPv6Address(outer))


@given(st.ip_addresses())
def test_what_is_allowed_is_public(address: ipaddress.IPv4Address | ipaddress.IPv6Address) -> None:
    allowed = not why_refused(address)
    assert not (allowed and (is_private(address) or address.is_multicast))
    if isinstance(address, ipaddress.IPv4Address):
        assert (why_refused(ipaddress.IPv6Address(f"64:ff9b::{address}")) == "") is allowed
        assert why_refused(ipaddress.IPv6Address(f"::ffff:{address}"))


@given(st.sampled_from(["169.254.169.254", "169.254.170.2", "100.100.100.200", "168.63.129.16"]))
def test_no_form_of_an_address_leads_to_the_keys_of_a_cloud(text: str) -> None:
    """Not even for a host that may be private."""
    inner = ipaddress.IPv4Address(text)
    high, low = f"{inner.packed[:2].hex()}", f"{inner.packed[2:].hex()}"
    away = (int(inner) ^ 0xFFFFFFFF).to_bytes(4, "big").hex(":", 2)  # Teredo hides a client's address so
    for form in (
        *(f"::{text}", f"::ffff:{text}", f"::ffff:0:{text}", f"64:ff9b::{text}", f"64:ff9b:1::{text}"),
        *(f"64:ff9b:1:{high}:00{low[:2]}:{low[2:]}00::", f"2002:{high}:{low}::1"),
        *(f"2001:0:{high}:{low}::1", f"2001:0:5db8:d70e:0:0:{away}"),
        *(f"2606:2800::5efe:{high}:{low}", f"fe80::200:5efe:{high}:{low}"),
    ):
        assert why_refused(ipaddress.IPv6Address(form), listed=True) == "it leads to a cloud's metadata", form


@pytest.mark.parametrize(
    ("address", "allowed", "allowed_if_listed"),
    [
        ("93.184.215.14", True, True),
        ("2606:2800:21f:cb07:6820:80da:af6b:8b2c", True, True),
        ("64:ff9b::5db8:d70e", True, True),
        ("fd12:3456::1", False, True),
        ("fd00:ec2::254", False, False),
        ("0.0.0.0", False, False),
        ("::", False, False),
        ("255.255.255.255", False, False),
        ("2002:7f00:1::", False, True),
        ("5f00::1", False, True),
        ("100:0:0:1::1", False, True),
        ("4000::1", False, True),
        ("2606:2800::5efe:10.0.0.1", False, True),
        ("192.0.0.9", True, True),
        ("192.88.99.1", False, True),
        ("192.88.99.2", False, True),
    ],
)
def test_which_addresses_are_allowed(address: str, allowed: bool, allowed_if_listed: bool) -> None:
    parsed = ipaddress.ip_address(address)
    assert (why_refused(parsed) == "") is allowed
    assert (why_refused(parsed, listed=True) == "") is allowed_if_listed


# ---- the configuration


@pytest.mark.parametrize(
    ("url", "why"),
    [
        ("ftp://hooks.example/", "is not a URL"),
        ("hooks.example", "is not a URL"),
        ("https://", "is not a URL"),
        ("https://anna:secret@hooks.example/", "has a user name or password"),
        ("https://hooks.example:99999/", "is not a URL"),
    ],
)
def test_a_wrong_address_is_refused_and_not_repeated(tmp_path: Path, url: str, why: str) -> None:
    file = tmp_path / "daq.toml"
    file.write_text(f'[notifications.webhooks.lab]\nurl = "{url}"\nsecret = "secret"\n', "utf-8")
    with pytest.raises(SpecError, match=f"notifications.webhooks.lab.url: {why}") as refused:
        load_settings(file)
    assert "hooks" not in str(refused.value).replace("webhooks", "")


def test_plain_http_is_refused_to_hosts_that_are_not_listed(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="write https"):
        made(tmp_path, "http://hooks.example/")


@pytest.mark.parametrize("text", ["", "whsec_", "hush", "whsec_c2hvcnQ=", f"whsec_{'A' * 100}", "whsec_ÄÖ"])
def test_a_wrong_secret_is_refused_and_not_repeated(tmp_path: Path, text: str) -> None:
    file = tmp_path / "secret"
    file.write_text(text, "utf-8")
    with pytest.raises(SpecError) as refused:
        load_secret(file)
    assert not text or text not in str(refused.value).replace("write whsec_", "")
