"""Names of the cookies of people who sign in."""

from __future__ import annotations

import pytest

from server.access.session_cookie import session_cookie, session_of, sign_in_cookie


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
    assert sign_in_cookie(address) == name.removeprefix("__Host-").replace("session", "sign-in")


def test_a_service_takes_no_other_service_s_session() -> None:
    headers = {"cookie": "daq-session-8300=one; daq-session-8301=two; daq-session=three"}
    assert session_of(headers, "daq-session-8301") == "two"
    assert session_of(headers, "__Host-daq-session-8301") == ""
    assert session_of({}, "daq-session-8301") == ""
