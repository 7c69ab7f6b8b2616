"""People sign in by OpenID Connect: a real service, a real provider in a process of its own, real redirects."""

import signal
import socket
import sqlite3
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import parse_qs, urljoin, urlsplit

import httpx
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from server.access.sessions import SessionStore
from server.store.engine import Store
from tests.extras.lab.oidc.provider import Provider, running_provider
from tests.server.access.people import LATER, SPEC, kind_of
from tests.server.service import Service, running_service

OPERATORS = {"preferred_username": "anna", "groups": ["staff", "robot-operators"]}
TIMEOUT = 60.0


@pytest.fixture(scope="module")
def provider() -> Iterator[Provider]:
    """One that knows anna."""
    with running_provider() as found:
        found.person("anna-1", **OPERATORS)
        yield found


def _configure(folder: Path, issuer: str, port: int, **more: object) -> None:
    lines = [f"{key} = {value!r}" for key, value in more.items()]
    (folder / "daq.toml").write_text(
        f"""
[server]
tokens = "always"
stop_port = 0
connect_at_start = false
address = "http://127.0.0.1:{port}"

[oidc]
issuer = "{issuer}"
client_id = "ma2000"
roles = {{ robot-operators = "operator", robot-owners = "owner", robot-guests = "viewer", robot-admins = "admin" }}
label = "the laboratory"
{chr(10).join(lines)}
"""
    )


def _free_port() -> int:
    with closing(socket.create_server(("127.0.0.1", 0))) as listener:
        return int(listener.getsockname()[1])


@contextmanager
def service_of_people(folder: Path, issuer: str, **more: object) -> Iterator[Service]:
    port = _free_port()
    _configure(folder, issuer, port, **more)
    with running_service(folder, "mock://?pty=1&lock_step=1", "--port", str(port)) as service:
        yield service


@pytest.fixture(scope="module")
def service(provider: Provider, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service whose people sign in at that provider."""
    with service_of_people(tmp_path_factory.mktemp("service"), provider.url) as found:
        yield found


def _seen(answer: httpx.Response) -> str:
    """Where a browser goes: addresses of the service itself as their path."""
    return urljoin(answer.url.path, answer.headers["location"])


@dataclass
class Browser:
    """Somebody's browser: it keeps cookies, and says where its requests are from."""

    service: Service
    client: httpx.Client

    def begin(self) -> str:
        """Opens the sign-in. Where the service sends the browser."""
        answer = self.client.get("/api/v1/login/start")
        assert answer.status_code == 303, answer.text
        return _seen(answer)

    def back(self, address: str) -> str:
        """Comes back from the provider. Where the service sends the browser then."""
        answer = self.client.get(address)
        assert answer.status_code == 303, answer.text
        return _seen(answer)

    def sign_in(self, provider: Provider, subject: str = "anna-1") -> str:
        return self.back(provider.sign_in(self.begin(), subject))

    def me(self) -> httpx.Response:
        """Who the service takes them for."""
        return self.client.get("/api/v1/me")

    def ask(self, method: str, path: str, body: object = None) -> httpx.Response:
        """A request of the page."""
        return self.client.request(method, f"/api/v1{path}", json=body, headers={"Origin": self.service.url})


@pytest.fixture
def browser(service: Service) -> Iterator[Browser]:
    """Nobody has signed in with it."""
    with _browser(service) as found:
        yield found


@contextmanager
def _browser(service: Service) -> Iterator[Browser]:
    with httpx.Client(base_url=service.url, timeout=TIMEOUT) as client:
        yield Browser(service, client)


def _cookie(service: Service) -> str:
    """Name of its sessions' cookie."""
    return f"daq-session-{urlsplit(service.url).port}"


def _sessions(service: Service) -> int:
    file = service.folder / "service" / "service.sqlite"
    with closing(sqlite3.connect(file)) as connection:
        return int(connection.execute("SELECT count(*) FROM sessions").fetchone()[0])


def test_somebody_signs_in_works_and_leaves(browser: Browser, provider: Provider) -> None:
    assert browser.client.get("/api/v1/login").json() == {
        "openid": {"label": "the laboratory", "start": "/api/v1/login/start"}
    }
    assert kind_of(browser.me()) == (401, "token-needed")
    assert browser.sign_in(provider) == "/"
    me = browser.me().json()
    assert (me["name"], me["role"], me["owner_of"]) == ("anna", "operator", [])
    assert me["session_until"]
    made = browser.ask("POST", "/robots/ma2000/experiments", {"spec": SPEC, "at": LATER})
    assert (made.status_code, made.json()["owner"]) == (201, "anna")
    ticket = browser.ask("POST", "/tickets").json()["ticket"]
    with connect(f"{browser.service.url.replace('http', 'ws')}/api/v1/robots/ma2000/live?ticket={ticket}") as live:
        live.send('{"subscribe":["robot"]}')
        assert '"robot"' in str(live.recv(TIMEOUT))
        left = browser.ask("POST", "/logout").json()["provider"]
        with suppress(ConnectionClosed):
            while live.recv(TIMEOUT):
                pass
        assert live.close_code == 1008
    assert left.startswith(f"{provider.url}/oauth2/end_session?client_id=ma2000&post_logout_redirect_uri=")
    assert httpx.get(left).status_code == 200
    assert kind_of(browser.me()) == (401, "token-needed")


def test_of_two_uses_of_an_answer_at_once_one_is_refused(browser: Browser, provider: Provider) -> None:
    back = provider.sign_in(browser.begin(), "anna-1")
    provider.process.send_signal(signal.SIGSTOP)  # whichever comes first waits for the provider
    try:
        with ThreadPoolExecutor(2) as pool:
            uses = [pool.submit(browser.back, back) for _ in range(2)]
            first = next(as_completed(uses)).result()
            provider.process.send_signal(signal.SIGCONT)
            assert (first, sorted(use.result() for use in uses)) == ("/?sign-in=sign-in-unknown", ["/", first])
    finally:
        provider.process.send_signal(signal.SIGCONT)


def test_what_is_asked_has_a_challenge_a_state_and_a_nonce_and_each_is_new(browser: Browser) -> None:
    asked = [parse_qs(urlsplit(browser.begin()).query) for _ in range(2)]
    for one in asked:
        assert one["response_type"] == ["code"]
        assert one["code_challenge_method"] == ["S256"]
        assert one["scope"] == ["openid profile"]
    for name in ("state", "nonce", "code_challenge"):
        assert asked[0][name] != asked[1][name]
        assert len(asked[0][name][0]) >= 43  # 256 bits


def test_cookies_are_for_this_page_alone(browser: Browser, provider: Provider) -> None:
    started = browser.client.get("/api/v1/login/start")
    assert "HttpOnly" in started.headers["set-cookie"]
    assert "SameSite=lax" in started.headers["set-cookie"]
    back = provider.sign_in(started.headers["location"], "anna-1")
    made = browser.client.get(back).headers.get_list("set-cookie")
    cookie = next(one for one in made if one.startswith(f"{_cookie(browser.service)}="))
    assert all(part in cookie for part in ("HttpOnly", "SameSite=strict", "Path=/", "Max-Age=43200"))


def test_two_services_at_one_host_name_keep_their_sessions_apart(
    service: Service, provider: Provider, tmp_path: Path
) -> None:
    provider.person("berta-1", preferred_username="berta", groups=["robot-guests"])
    # This client sends cookies as browsers do: to every port of the host.
    with service_of_people(tmp_path, provider.url) as other, httpx.Client(timeout=TIMEOUT) as client:

        def begin(at: Service) -> str:
            return str(client.get(f"{at.url}/api/v1/login/start").headers["location"])

        def me(at: Service) -> str:
            return str(client.get(f"{at.url}/api/v1/me").json().get("name"))

        def stops() -> list[int]:
            doors = [
                (f"http://127.0.0.1:{port}/api/v1/fleet/stop", at.url)
                for port, (_, at) in zip(ports, both, strict=True)
            ]
            return [client.post(door, headers={"Origin": page}).status_code for door, page in doors]

        both = [(provider.sign_in(begin(at), subject), at) for at, subject in ((service, "anna-1"), (other, "berta-1"))]
        for back, _ in both:
            assert _seen(client.get(back)) == "/"
        assert (me(service), me(other)) == ("anna", "berta")
        ports = [client.get(f"{at.url}/api/v1/system").json()["stop_port"] for _, at in both]
        assert stops() == [200, 200]
        assert client.post(f"{other.url}/api/v1/logout", headers={"Origin": other.url}).status_code == 200
        assert (me(service), me(other)) == ("anna", "None")
        assert stops() == [200, 401]


def _rows(service: Service, action: str, subject: str | None = None) -> list[tuple[str, str]]:
    """Outcome and detail of the audit log's rows, as soon as there is one."""
    query = "SELECT outcome, detail FROM audit WHERE action = ? AND (? IS NULL OR subject = ?)"
    while True:
        with closing(sqlite3.connect(service.folder / "service" / "service.sqlite")) as connection:
            found = connection.execute(query, (action, subject, subject)).fetchall()
        if found:
            return found


def test_refused_sign_ins_and_sign_outs_by_command_have_rows(provider: Provider, tmp_path: Path) -> None:
    with service_of_people(tmp_path, provider.url) as service, _browser(service) as browser:
        assert browser.back(f"{service.url}/api/v1/login/callback?state=unknown") == "/?sign-in=sign-in-unknown"
        assert _rows(service, "finish_login") == [("refused", "sign-in-unknown")]
        browser.sign_in(provider)
        with closing(Store(service.folder / "service" / "service.sqlite")) as store:
            now = datetime.now(UTC)
            assert SessionStore(store).end_all("anna", now, "root") == 1
            assert SessionStore(store).end_all("anna", now, "root") == 0
        assert _rows(service, "sign_out", "anna") == [("done", "")]


def test_a_session_s_secret_is_not_in_the_database_and_is_no_token(browser: Browser, provider: Provider) -> None:
    browser.sign_in(provider)
    secret = browser.client.cookies[_cookie(browser.service)]
    files = [path for path in (browser.service.folder / "service").glob("service.sqlite*") if path.is_file()]
    assert files
    assert all(secret.encode() not in path.read_bytes() for path in files)
    headers = {"Authorization": f"Bearer {secret}"}
    for path in ("/api/v1/robots/ma2000/queue/pause", "/api/v1/robots/ma2000/stop"):
        answer = httpx.post(f"{browser.service.url}{path}", headers=headers, timeout=TIMEOUT)
        assert kind_of(answer) == (401, "token-unknown")


@pytest.mark.parametrize(
    ("claims", "kind"),
    [
        ({"iss": "https://other.example"}, "sign-in-not-proven"),
        ({"aud": "another-client"}, "sign-in-not-proven"),
        ({"aud": ["ma2000", "another"], "azp": "another"}, "sign-in-not-proven"),
        ({"nonce": "another"}, "sign-in-not-proven"),
        ({"exp": 1_000_000_000}, "sign-in-not-proven"),
        ({"iat": 4_000_000_000}, "sign-in-not-proven"),
        ({"exp": "soon"}, "sign-in-not-proven"),
        ({"at_hash": "AAAAAAAAAAAAAAAAAAAAAA"}, "sign-in-not-proven"),
        ({"groups": ["staff"]}, "no-role"),
        ({"groups": []}, "no-role"),
        ({"groups": {"robot-operators": 1}}, "no-role"),
        ({"groups": None}, "no-role"),
        ({"preferred_username": ""}, "no-name"),
        ({"preferred_username": "a\nb"}, "no-name"),
        ({"preferred_username": "x" * 65}, "no-name"),
        ({"preferred_username": 7}, "no-name"),
        ({"preferred_username": "local"}, "name-taken"),
    ],
)
def test_who_is_not_proven_or_has_no_role_is_not_admitted(
    browser: Browser, provider: Provider, claims: dict[str, object], kind: str
) -> None:
    before = _sessions(browser.service)
    provider.person("mallory", **(OPERATORS | {"preferred_username": "mallory"} | claims))
    assert browser.sign_in(provider, "mallory") == f"/?sign-in={kind}"
    assert kind_of(browser.me()) == (401, "token-needed")
    assert _sessions(browser.service) == before


@pytest.mark.parametrize(
    ("groups", "role"),
    [("robot-guests", "viewer"), (["robot-guests", "robot-owners"], "owner"), (["robot-admins"], "admin")],
)
def test_the_highest_role_counts(browser: Browser, provider: Provider, groups: object, role: str) -> None:
    provider.person(f"{role}-1", preferred_username=f"a {role}", groups=groups)
    browser.sign_in(provider, f"{role}-1")
    assert browser.me().json()["role"] == role


def test_an_answer_is_accepted_once_and_in_the_browser_that_asked(browser: Browser, provider: Provider) -> None:
    answer = provider.sign_in(browser.begin(), "anna-1")
    with _browser(browser.service) as other:
        assert other.back(answer) == "/?sign-in=sign-in-unknown"
        other.begin()  # it has a cookie of its own now
        assert other.back(answer) == "/?sign-in=sign-in-unknown"
    assert browser.back(answer) == "/"
    assert browser.back(answer) == "/?sign-in=sign-in-unknown"


def test_a_code_is_accepted_once_and_only_with_its_verifier(browser: Browser, provider: Provider) -> None:
    first = provider.sign_in(browser.begin(), "anna-1")
    code = parse_qs(urlsplit(first).query)["code"][0]
    other_state = parse_qs(urlsplit(browser.begin()).query)["state"][0]
    stolen = f"{browser.service.url}/api/v1/login/callback?code={code}&state={other_state}"
    assert browser.back(stolen) == "/?sign-in=sign-in-refused"


@pytest.mark.parametrize(
    ("query", "kind"),
    [
        ("error=access_denied", "sign-in-refused"),
        ("", "sign-in-refused"),
        ("code=wrong", "sign-in-refused"),
        ("code=x&iss=https://other.example", "sign-in-not-proven"),
    ],
)
def test_a_refusal_or_another_provider_s_answer_is_told(browser: Browser, query: str, kind: str) -> None:
    state = parse_qs(urlsplit(browser.begin()).query)["state"][0]
    address = f"{browser.service.url}/api/v1/login/callback?state={state}&{query}"
    assert browser.back(address) == f"/?sign-in={kind}"


def test_a_name_belongs_to_whoever_had_it_first(browser: Browser, provider: Provider) -> None:
    provider.person("carl-1", preferred_username="carl", groups="robot-guests")
    provider.person("carl-2", preferred_username="carl", groups="robot-admins")
    assert browser.sign_in(provider, "carl-1") == "/"
    with _browser(browser.service) as other:
        assert other.sign_in(provider, "carl-2") == "/?sign-in=name-taken"
    provider.person("carl-1", preferred_username="anna", groups="robot-guests")
    browser.sign_in(provider, "carl-1")
    assert browser.me().json()["name"] == "carl", "a person keeps their name"


@pytest.mark.parametrize(
    "headers",
    [{}, {"Origin": "https://evil.example"}, {"Sec-Fetch-Site": "cross-site"}, {"Sec-Fetch-Site": "same-site"}],
)
def test_no_other_page_uses_a_session(browser: Browser, provider: Provider, headers: dict[str, str]) -> None:
    browser.sign_in(provider)
    answer = browser.client.post("/api/v1/robots/ma2000/queue/pause", headers=headers)
    assert kind_of(answer) == (403, "other-origin")


def test_both_doors_stop_for_a_session_of_every_role(provider: Provider, service: Service) -> None:
    service.robot.headers["Authorization"] = "none"
    stop_port = None
    for number, group in enumerate(("robot-guests", "robot-operators", "robot-owners", "robot-admins")):
        provider.person(f"stopper-{number}", preferred_username=f"stopper {number}", groups=group)
        with _browser(service) as browser:
            browser.sign_in(provider, f"stopper-{number}")
            stop_port = stop_port or browser.client.get("/api/v1/system").json()["stop_port"]
            if group == "robot-guests":
                assert kind_of(browser.ask("POST", "/robots/ma2000/connect")) == (403, "operator-needed")
            assert browser.ask("POST", "/robots/ma2000/stop").json()["delivered"] is not None
            listener = f"http://127.0.0.1:{stop_port}/api/v1/robots/ma2000/stop"
            cookie = {"Cookie": f"{_cookie(service)}={browser.client.cookies[_cookie(browser.service)]}"}
            page = {"Origin": service.url}
            answer = httpx.post(listener, headers=cookie | page, timeout=TIMEOUT)
            assert answer.status_code == 200, answer.text
            assert answer.headers["access-control-allow-credentials"] == "true"
            assert kind_of(httpx.post(listener, headers=cookie, timeout=TIMEOUT)) == (401, "token-needed")
            evil = httpx.post(listener, headers=cookie | {"Origin": "https://evil.example"}, timeout=TIMEOUT)
            assert kind_of(evil) == (403, "other-origin")


def _until_not_200(ask: Callable[[], httpx.Response]) -> None:
    """Asks ten times a second: the service refuses a caller who asks as quickly as it answers."""
    between = threading.Event()
    while ask().status_code == 200:
        between.wait(0.1)


def test_a_session_outlasts_the_provider_and_a_restart_and_ends_in_time(tmp_path: Path) -> None:
    with running_provider() as provider:
        provider.person("anna-1", **OPERATORS)
        with service_of_people(tmp_path, provider.url) as service, _browser(service) as browser:
            browser.sign_in(provider)
            cookie = browser.client.cookies[_cookie(browser.service)]
        provider.end()
    with service_of_people(tmp_path, provider.url) as service, _browser(service) as browser:
        assert browser.begin() == "/?sign-in=provider-away"
        browser.client.cookies.set(_cookie(service), cookie)
        assert browser.me().json()["name"] == "anna"
        port = browser.client.get("/api/v1/system").json()["stop_port"]
        file = service.folder / "service" / "service.sqlite"
        with closing(sqlite3.connect(file)) as connection, connection:
            connection.execute("UPDATE sessions SET expires = datetime('now', '-10 minutes') || '.000000'")
        _until_not_200(browser.me)  # the service reads its sessions every 2 s
        assert kind_of(browser.me()) == (401, "token-needed")
        assert kind_of(browser.ask("POST", "/robots/ma2000/queue/pause")) == (401, "token-needed")
        assert browser.ask("POST", "/robots/ma2000/stop").status_code == 200, "an ended session still stops for an hour"
        listener = f"http://127.0.0.1:{port}/api/v1/fleet/stop"
        headers = {"Cookie": f"{_cookie(service)}={cookie}", "Origin": service.url}
        assert httpx.post(listener, headers=headers, timeout=TIMEOUT).status_code == 200
        with closing(sqlite3.connect(file)) as connection, connection:
            connection.execute("UPDATE sessions SET expires = datetime('now', '-2 hours') || '.000000'")
        _until_not_200(lambda: browser.ask("POST", "/robots/ma2000/stop"))
        _until_not_200(lambda: httpx.post(listener, headers=headers, timeout=TIMEOUT))


def test_a_provider_may_change_its_keys(tmp_path: Path) -> None:
    with running_provider() as provider, service_of_people(tmp_path, provider.url) as service:
        provider.person("anna-1", **OPERATORS)
        with _browser(service) as browser:
            assert browser.sign_in(provider) == "/"
        provider.end()
        with running_provider(provider.port) as renewed, _browser(service) as browser:
            renewed.person("anna-1", **OPERATORS)
            assert browser.sign_in(renewed) == "/"
            assert browser.me().json()["name"] == "anna"


def test_a_provider_that_calls_itself_otherwise_is_not_used(provider: Provider, tmp_path: Path) -> None:
    named = provider.url.replace("127.0.0.1", "localhost")
    other = f"{named}/"
    with service_of_people(tmp_path, other) as service, _browser(service) as browser:
        assert browser.begin() == "/?sign-in=provider-away"


def test_a_stop_waits_neither_for_the_database_nor_for_the_provider(tmp_path: Path) -> None:
    with (
        running_provider() as provider,
        service_of_people(tmp_path, provider.url) as service,
        _browser(service) as browser,
    ):
        provider.person("anna-1", **OPERATORS)
        browser.sign_in(provider)
        assert browser.ask("POST", "/robots/ma2000/connect").status_code == 200
        port = browser.client.get("/api/v1/system").json()["stop_port"]
        cookie = browser.client.cookies[_cookie(browser.service)]
        provider.end()
        file = service.folder / "service" / "service.sqlite"
        with closing(sqlite3.connect(file, isolation_level=None)) as connection:
            connection.execute("BEGIN EXCLUSIVE")
            try:
                begun = time.monotonic()
                assert browser.ask("POST", "/robots/ma2000/stop").json()["confirmed"] is True
                headers = {"Cookie": f"{_cookie(service)}={cookie}", "Origin": service.url}
                listener = f"http://127.0.0.1:{port}/api/v1/robots/ma2000/stop"
                assert httpx.post(listener, headers=headers, timeout=TIMEOUT).json()["confirmed"] is True
                assert time.monotonic() - begun < 5.0, "SQLite waits 5 s for a lock"
            finally:
                connection.execute("ROLLBACK")
