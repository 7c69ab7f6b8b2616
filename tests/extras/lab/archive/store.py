"""A store that speaks S3, as a process of another project's, and a proxy before it that fails as it is told."""

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Literal
from urllib.parse import urlsplit

from extras.lab.archive.bucket import Bucket, Credentials
from extras.lab.archive.settings import ArchiveSettings

STORE = """
import sys
from moto.server import ThreadedMotoServer
server = ThreadedMotoServer(ip_address=sys.argv[1], port=int(sys.argv[2]), verbose=False)
server.start()
print("http://%s:%s" % server.get_host_and_port(), flush=True)
sys.stdin.read()
server.stop()
"""
"""The store's process, which ends with ours."""
ACCESS, SECRET = "AKIDOFATEST", "a-secret-of-a-test"
CREDENTIALS = Credentials.model_validate({"access_key": ACCESS, "secret_key": SECRET})
Fault = Literal["", "500", "503", "403", "stall", "cut", "wrong", "refuse", "redirect"]


@dataclass
class ObjectStore:
    """The store, and an independent client of it, which does not go through the proxy."""

    url: str
    client: Any
    process: subprocess.Popen[bytes]
    made: int = 0

    def bucket(self) -> str:
        self.made += 1
        name = f"traces-{self.made}"
        self.client.create_bucket(Bucket=name)
        return name

    def objects(self, bucket: str) -> dict[str, bytes]:
        """What lies in a bucket, by name. An object that is deleted between the list and its own turn is not there."""
        found = {}
        for one in self.client.list_objects_v2(Bucket=bucket).get("Contents", []):
            with suppress(self.client.exceptions.NoSuchKey):
                found[one["Key"]] = self.client.get_object(Bucket=bucket, Key=one["Key"])["Body"].read()
        return found


@contextmanager
def running_store(host: str = "127.0.0.1", port: int = 0) -> Iterator[ObjectStore]:
    """moto's server in a process of its own, and Amazon's client."""
    import boto3  # here: the quick tests in this folder are collected without it

    process = subprocess.Popen(
        [sys.executable, "-c", STORE, host, str(port)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    url = process.stdout.readline().decode().strip()
    assert url, "the store did not start"
    client = boto3.client(
        "s3", endpoint_url=url, region_name="us-east-1", aws_access_key_id=ACCESS, aws_secret_access_key=SECRET
    )
    try:
        yield ObjectStore(url, client, process)
    finally:
        client.close()
        process.kill()
        process.wait()
        process.stdin.close()
        process.stdout.close()


@dataclass
class FaultyStore:
    """A proxy before a store. `fault` is what happens to requests whose method is one of `methods`; `left` is how
    often, None for always; `only` is a part of the path of those that are meant."""

    url: str
    fault: Fault = ""
    methods: tuple[str, ...] = ("GET", "HEAD", "PUT", "POST", "DELETE")
    left: int | None = None
    only: str = ""
    seen: list[str] = field(default_factory=list)
    paths: list[str] = field(default_factory=list)
    stalled: threading.Event = field(default_factory=threading.Event)
    """Set when a request stalls."""
    go_on: threading.Event = field(default_factory=threading.Event)
    """Ends what stalls."""

    def fail(self, fault: Fault, *methods: str, times: int | None = None, only: str = "") -> None:
        self.only = only
        self.methods = methods or ("GET", "HEAD", "PUT", "POST", "DELETE")
        self.left = times
        self.fault = fault

    def taken(self, method: str, path: str) -> Fault:
        """The fault of a request."""
        self.seen.append(method)
        if not self.fault or method not in self.methods or self.left == 0 or self.only not in path:
            return ""
        if self.left is not None:
            self.left -= 1
        return self.fault


@contextmanager
def faulty(store: ObjectStore) -> Iterator[FaultyStore]:
    """A proxy of its own port, which ends every connection with its answer."""
    behind = urlsplit(store.url)
    proxy = FaultyStore("")

    class Handler(BaseHTTPRequestHandler):
        def log_message(self, *_told: Any) -> None:
            """Says nothing."""

        def _pass_on(self) -> None:
            body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
            proxy.paths.append(self.path)
            match proxy.taken(self.command, self.path):
                case "refuse":
                    return
                case "stall":
                    proxy.stalled.set()
                    proxy.go_on.wait(30)
                    return
                case "redirect":
                    self._answer(307, {"Location": f"{proxy.url}/elsewhere"}, b"")
                    return
                case "500" | "503" | "403" as status:
                    said = f"<Error><Code>Odd</Code><AWSAccessKeyId>{ACCESS}</AWSAccessKeyId></Error>"
                    self._answer(int(status), {"Content-Type": "application/xml"}, said.encode())
                    return
                case fault:
                    pass
            with closing(HTTPConnection(str(behind.hostname), int(behind.port or 0), timeout=30)) as connection:
                connection.request(self.command, self.path, body, dict(self.headers))
                answer = connection.getresponse()
                content = answer.read()
                headers = {name: value for name, value in answer.getheaders() if name.lower() not in HOP}
                if fault == "wrong" and content:
                    content = bytes([content[0] ^ 1]) + content[1:]
            self._answer(answer.status, headers, content, cut=fault == "cut")

        def _answer(self, status: int, headers: dict[str, str], content: bytes, *, cut: bool = False) -> None:
            self.send_response_only(status)
            headers = {name: value for name, value in headers.items() if name.lower() != "content-length"} | (
                {"Content-Length": headers["Content-Length"]}
                if self.command == "HEAD" and "Content-Length" in headers
                else {"Content-Length": str(len(content))}
            )
            for name, value in headers.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(content[: len(content) // 2] if cut else content)

        do_GET = do_HEAD = do_PUT = do_POST = do_DELETE = _pass_on

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        server.daemon_threads = True
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, name="proxy")
        thread.start()
        proxy.url = f"http://127.0.0.1:{server.server_address[1]}"
        try:
            yield proxy
        finally:
            proxy.go_on.set()
            server.shutdown()
            thread.join()


HOP = ("connection", "transfer-encoding", "date", "server")


def settings_of(bucket: str, url: str, **more: Any) -> ArchiveSettings:
    """The configuration of an archive. Its requests have the time that they need on a busy machine: a store that is
    given up too early is asked again, and may never be quick enough."""
    return ArchiveSettings(bucket=bucket, endpoint=url, **{"timeout": 20.0, **more})


def bucket_of(bucket: str, url: str, **more: Any) -> Bucket:
    """A bucket, as the service opens it."""
    return Bucket(settings_of(bucket, url, **more), CREDENTIALS)
