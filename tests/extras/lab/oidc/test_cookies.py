"""Names of the cookies of people who sign in."""

from contextlib import closing, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from types import SimpleNamespace
from typing import Any

import pytest
from fastapi import Response

from extras.lab.oidc.routes import _set_cookie
from extras.lab.oidc.sign_in import GOOD_FOR, SignIns
from server.access.cookies import session_cookie, session_of, sign_in_cookie
from server.problems import ProblemError
from tests.server.authority import Authority
from tests.server.clocks import HandClock
from tests.server.dashboard.browser import WITHOUT_3D, chromium, playwright


@pytest.mark.parametrize(
    ("address", "name"),
    [
        ("https://arm.lab", "__Host-daq-session-443"),
        ("HTTPS://arm.lab:8443/", "__Host-daq-session-8443"),
        ("http://localhost:8300", "daq-session-8300"),
        ("http://127.0.0.1", "daq-session-80"),
        (None, "daq-session"),
    ],
)
def test_a_cookie_has_the_port_at_which_people_reach_the_service(address: str | None, name: str) -> None:
    assert session_cookie(address) == name
    assert sign_in_cookie(address) == name.replace("session", "sign-in")


def test_a_service_takes_no_other_service_s_session() -> None:
    headers = {"cookie": "daq-session-8300=one; daq-session-8301=two; daq-session=three"}
    assert session_of(headers, "daq-session-8301") == "two"
    assert session_of(headers, "__Host-daq-session-8301") == ""
    assert session_of({}, "daq-session-8301") == ""


def _taken(sign_ins: SignIns, state: str, cookie: str) -> bool:
    with suppress(ProblemError), sign_ins.answer(state, cookie):
        return True
    return False


def test_nobody_on_their_way_is_lost_however_many_begin() -> None:
    clock = HandClock()
    sign_ins = SignIns(clock)
    asked, cookie = sign_ins.begin("arm-2")
    others = [sign_ins.begin("") for _ in range(10_001)]
    for state, brought in (
        (asked.state, others[0][1]),  # of another browser
        (asked.state, cookie.replace("arm-2", "arm-3")),
        ("é\ud800", ".."),
    ):
        assert not _taken(sign_ins, state, brought)
    with pytest.raises(ZeroDivisionError), sign_ins.answer(asked.state, cookie):
        raise ZeroDivisionError  # the provider is away: the same answer may come again
    with sign_ins.answer(asked.state, cookie) as found:
        assert (found.asked, found.robot) == (asked, "arm-2")
        assert not _taken(sign_ins, asked.state, cookie)  # while the provider is asked, nor afterwards
    assert not _taken(sign_ins, asked.state, cookie)
    assert _taken(sign_ins, others[0][0].state, others[0][1])
    clock.turn(GOOD_FOR)
    assert not _taken(sign_ins, others[1][0].state, others[1][1])
    assert len({asked.state, asked.nonce, asked.verifier}) == 3


@pytest.mark.browser
def test_a_browser_takes_both_cookies_over_tls_and_a_page_of_another_path_or_host_sets_neither(tmp_path: Path) -> None:
    """Chromium is the witness of what `__Host-` demands."""
    set_cookies: list[str] = []

    class Page(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            for one in set_cookies:
                self.send_header("Set-Cookie", one)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Quiet."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Page)
    server.socket = Authority(tmp_path, "localhost").server().wrap_socket(server.socket, server_side=True)
    address = f"https://localhost:{server.server_port}"
    services: Any = SimpleNamespace(settings=SimpleNamespace(server=SimpleNamespace(address=address)))
    names = (session_cookie(address), sign_in_cookie(address))
    with server, playwright() as driver, chromium(driver, *WITHOUT_3D) as browser:
        Thread(target=server.serve_forever, daemon=True).start()
        for spoilt in ("", "; Domain=localhost", "; Path=/api"):
            answer = Response()
            for name in names:
                _set_cookie(answer, services, name, "secret", GOOD_FOR, "lax")
            set_cookies[:] = [one + spoilt for one in answer.headers.getlist("set-cookie")]
            with closing(browser.new_context(ignore_https_errors=True)) as context:
                context.new_page().goto(f"{address}/")
                kept = {one["name"] for one in context.cookies()}
                assert kept == (set() if spoilt else set(names)), (spoilt, kept)
        server.shutdown()
