"""The service behind the real Caddy and the real nginx, with the configurations of `deploy/`, over TLS."""

import shutil
import socket
import ssl
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest
import trustme
from playwright.sync_api import Page, expect
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.repository.tracked import ROOT
from tests.server.dashboard.browser import LIVE, NO_3D_HERE, WITHOUT_3D, chromium, playwright
from tests.server.service import DAQ, Service, running_service

NAMES = ("arm.lab", "lab")
MAIN = """daemon off; worker_processes 1; pid {folder}/nginx.pid; error_log stderr;
events {{}}
http {{ access_log off; client_body_temp_path {folder}/a; proxy_temp_path {folder}/b; fastcgi_temp_path {folder}/c;
    uwsgi_temp_path {folder}/d; scgi_temp_path {folder}/e; include {folder}/arm.conf; }}
"""
CONFIGURATION = '[server]\ntokens = "always"\nnames = ["arm.lab", "lab"]\n'


@dataclass(frozen=True)
class Behind:
    """A service, a token of an operator, and the port of the proxy before it."""

    service: Service
    token: str
    port: int
    authority: trustme.CA

    @property
    def context(self) -> ssl.SSLContext:
        """Trusts the certificate of the proxy alone."""
        made = ssl.create_default_context()
        self.authority.configure_trust(made)
        return made

    def ask(self, method: str, address: str, **headers: str) -> httpx.Response:
        """Sends a request as a browser does that looks up the name elsewhere: to this computer."""
        where = urlsplit(address)
        sent = {"Host": where.netloc, "Authorization": f"Bearer {self.token}", **headers}
        with httpx.Client(verify=self.context, timeout=60) as client:
            return client.request(
                method,
                f"https://127.0.0.1:{self.port}{where.path}",
                headers=sent,
                extensions={"sni_hostname": where.hostname},
                json={} if method == "POST" else None,
            )


def _free_port() -> int:
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _configured(name: str, folder: Path, service: str, port: int) -> list[str]:
    """Writes the configuration for these ports and certificates. Returns the command that runs the proxy."""
    text = (ROOT / "deploy" / {"caddy": "Caddyfile", "nginx": "nginx.conf"}[name]).read_text("utf-8")
    for given, here in (
        ("127.0.0.1:8300", urlsplit(service).netloc),
        ("/etc/ssl/arm.pem", str(folder / "arm.pem")),
        ("/etc/ssl/private/arm.key", str(folder / "arm.key")),
        ("listen 443", f"listen 127.0.0.1:{port}"),
        *((f"\n{one} {{", f"\n{one}:{port} {{") for one in NAMES),
    ):
        assert given in text or name == "nginx" or "listen" in given
        text = text.replace(given, here)
    if name == "caddy":
        (folder / "Caddyfile").write_text(f"{{\n\tadmin off\n\tauto_https off\n}}\n{text}", "utf-8")
        return ["caddy", "run", "--adapter", "caddyfile", "--config", str(folder / "Caddyfile")]
    (folder / "arm.conf").write_text(text, "utf-8")
    (folder / "nginx.conf").write_text(MAIN.format(folder=folder), "utf-8")
    return ["nginx", "-p", str(folder), "-c", str(folder / "nginx.conf")]


@contextmanager
def _proxy(name: str, folder: Path, service: Service, token: str) -> Iterator[Behind]:
    if shutil.which(name) is None and not Path("/usr/sbin", name).exists():
        pytest.skip(f"needs {name}: apt install {name} (.ci/run does)")
    authority, port = trustme.CA(), _free_port()
    certificate = authority.issue_cert(*NAMES)
    certificate.private_key_pem.write_to_path(folder / "arm.key")
    (folder / "arm.pem").write_bytes(b"".join(blob.bytes() for blob in certificate.cert_chain_pems))
    command = _configured(name, folder, service.url, port)
    path = {"PATH": "/usr/sbin:/usr/bin:/bin", "HOME": str(folder), "XDG_DATA_HOME": str(folder)}
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(command, env=path, stdout=log, stderr=log)
    try:
        while True:
            assert process.poll() is None, (folder / "log").read_text("utf-8")
            try:
                socket.create_connection(("127.0.0.1", port), 1).close()
                break
            except OSError:
                time.sleep(0.02)
        yield Behind(service, token, port, authority)
    finally:
        process.terminate()
        process.wait()


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Service, str]]:
    """A service as the guide asks for behind a proxy, and a token of an operator."""
    folder = tmp_path_factory.mktemp("served")
    (folder / "daq.toml").write_text(CONFIGURATION, "utf-8")
    command = [*DAQ, "token", "add", "anna", "--role", "operator"]
    made = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    token = made.stdout.split()[-1]
    headers = {"Authorization": f"Bearer {token}"}
    with running_service(folder, headers=headers) as service:
        service.until_connected()
        yield service, token


@pytest.fixture(scope="module", params=["caddy", "nginx"])
def behind(
    request: pytest.FixtureRequest, served: tuple[Service, str], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Behind]:
    """The service behind one of the proxies."""
    with _proxy(request.param, tmp_path_factory.mktemp(request.param), *served) as found:
        yield found


@pytest.mark.parametrize("root", ["https://arm.lab:{port}", "https://lab:{port}/arm"])
def test_requests_come_through_and_know_their_place(behind: Behind, root: str) -> None:
    root = root.format(port=behind.port)
    own, prefix = root.removesuffix("/arm"), urlsplit(root).path
    robot = f"{root}/api/v1/robots/ma2000"
    assert behind.ask("GET", f"{root}/").text.startswith("<!doctype html>")
    assert behind.ask("GET", robot).json()["robot"] == "ma2000"
    assert behind.ask("POST", f"{robot}/queue/pause", Origin=own, **{"Sec-Fetch-Site": "same-origin"}).is_success
    foreign = behind.ask("POST", f"{robot}/queue/pause", Origin="https://attacker.example")
    assert (foreign.status_code, foreign.json()["type"]) == (403, f"{prefix}/api/v1/problems#other-origin")
    assert 'id="other-origin"' in behind.ask("GET", f"{own}{prefix}/api/v1/problems").text
    made = behind.ask("POST", f"{robot}/experiments", Origin=own)
    assert made.headers["Location"] == f"{prefix}/api/v1/robots/ma2000/experiments/{made.json()['id']}"
    assert behind.ask("GET", f"{own}{made.headers['Location']}").json()["id"] == made.json()["id"]
    assert behind.ask("GET", robot, Authorization="").status_code == 401, "a proxy's requests are nobody's own"


@pytest.mark.parametrize(("origin", "admitted"), [("https://lab:{port}", True), ("https://attacker.example", False)])
def test_the_live_stream_comes_through(behind: Behind, origin: str, admitted: bool) -> None:
    url = f"wss://lab:{behind.port}/arm/api/v1/robots/ma2000/live"
    opened = socket.create_connection(("127.0.0.1", behind.port))
    headers = {"Authorization": f"Bearer {behind.token}"}
    with (
        nullcontext() if admitted else pytest.raises(InvalidStatus),
        connect(
            url,
            sock=opened,
            ssl=behind.context,
            server_hostname="lab",
            additional_headers=headers,
            origin=origin.format(port=behind.port),  # type: ignore[arg-type]
        ) as stream,
    ):
        stream.send('{"subscribe": ["robot"]}')
        assert '"topic":"robot"' in str(stream.recv(30))


@pytest.mark.browser
def test_the_page_works_below_a_path(behind: Behind) -> None:
    """In a real browser, which refuses what comes from elsewhere: the live stream, links, the reference of the API."""
    resolved = "--host-resolver-rules=MAP lab 127.0.0.1"
    with playwright() as driver, chromium(driver, *WITHOUT_3D, resolved) as browser:
        window = browser.new_context(ignore_https_errors=True, service_workers="block")  # asks for a real certificate
        complaints: list[str] = []
        root = f"https://lab:{behind.port}/arm"

        def watch(page: Page) -> None:
            page.on("console", lambda said: complaints.append(said.text) if said.type == "error" else None)
            page.on("requestfailed", lambda failed: complaints.append(failed.url))
            page.on("request", lambda r: None if r.url.startswith((root, "data:")) else complaints.append(r.url))

        window.on("page", watch)
        window.add_init_script(f"sessionStorage.setItem('ma2000-token', '{behind.token}')")
        page = window.new_page()
        page.goto(root)
        expect(page.get_by_role("banner").get_by_text(LIVE)).to_be_visible()
        page.goto(f"{root}/#/system")
        with window.expect_page() as opened:
            page.get_by_role("link", name="API reference").click()
        page = opened.value
        expect(page.get_by_text("Lists the robots", exact=False).or_(page.get_by_text("robots").first)).to_be_visible()
        page.get_by_role("link", name="Dashboard").click()
        expect(page).to_have_url(f"{root}/")
        assert [one for one in complaints if not one.startswith(NO_3D_HERE)] == []
