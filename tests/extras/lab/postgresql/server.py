"""A PostgreSQL server of the tests' own: Debian's programs, a data folder of its own, a socket in place of a port."""

import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

DEBIAN = Path("/usr/lib/postgresql")
FAST = ("fsync=off", "synchronous_commit=off", "full_page_writes=off")
"""Settings of a server whose data nobody needs after a power cut."""


def programs() -> Path | None:
    """Returns the folder of the newest PostgreSQL that is installed; None if there is none."""
    found = sorted(DEBIAN.glob("*/bin/postgres"), key=lambda path: int(path.parts[-3]))
    if found:
        return found[-1].parent
    on_path = shutil.which("postgres")
    return None if on_path is None else Path(on_path).resolve().parent


class PostgresServer:
    """A running server. PostgreSQL refuses to run as root, who starts it as the user `postgres`, then. It listens at a
    socket, and at `host` and `port` where these are given."""

    def __init__(self, folder: Path, programs: Path, host: str = "", port: int = 5432) -> None:
        self._programs = programs
        self._settings = (*FAST, f"listen_addresses={host}", f"port={port}")
        self._data, self._sockets = folder / "data", folder / "sockets"
        self._user = "postgres" if os.geteuid() == 0 else None
        self.name = self._user or pwd.getpwuid(os.geteuid()).pw_name
        for made in (self._data, self._sockets):
            made.mkdir(mode=0o700)
            if self._user is not None:
                shutil.chown(made, self._user)
        told = "--auth trust --auth-host scram-sha-256 --encoding UTF8 --no-sync"
        self._run("initdb", "--pgdata", str(self._data), *told.split())
        self._made = 0
        self.start()

    def start(self) -> None:
        """Starts the server, and waits until it takes connections."""
        options = " ".join(f"-c {setting}" for setting in (*self._settings, f"unix_socket_directories={self._sockets}"))
        self._ctl("start", "--wait", "--silent", "--options", options, "--log", str(self._sockets / "log"))

    def stop(self) -> None:
        """Ends the server at once, as a crash would."""
        self._ctl("stop", "--mode", "immediate", "--silent")

    def database(self, template: str = "template1") -> str:
        """Makes a database, and returns its address."""
        self._made += 1
        name = f"made{self._made}"
        self._run("createdb", "--host", str(self._sockets), "--template", template, name)
        return self.address(name)

    def make(self, user: str, password: str, database: str) -> None:
        """Makes a user, and a database that belongs to it."""
        role = f"CREATE ROLE {user} LOGIN PASSWORD '{password}'"
        for line in (role, f"CREATE DATABASE {database} OWNER {user}"):
            self._run("psql", "--host", str(self._sockets), "--dbname", "postgres", "--command", line)

    def address(self, name: str) -> str:
        """Returns the address of a database of this server."""
        return f"postgresql+psycopg://{self.name}@/{name}?host={self._sockets}"

    def _ctl(self, *arguments: str) -> None:
        self._run("pg_ctl", *arguments, "--pgdata", str(self._data))

    def _run(self, program: str, *arguments: str) -> None:
        command = [str(self._programs / program), *arguments]
        if self._user is not None and program in ("createdb", "psql"):
            command[1:1] = ["--username", self._user]
        ended = subprocess.run(
            command, user=self._user, cwd="/", capture_output=True, text=True, check=False, env={"LC_ALL": "C.UTF-8"}
        )
        if ended.returncode:
            raise RuntimeError(f"{program}: {ended.stderr.strip() or ended.stdout.strip()}")


@contextmanager
def running_postgresql(programs: Path, host: str = "", port: int = 5432) -> Iterator[PostgresServer]:
    """A server in a folder of its own, which is gone afterwards. A socket's path must be short."""
    with tempfile.TemporaryDirectory(prefix="pg-", ignore_cleanup_errors=True) as folder:
        Path(folder).chmod(0o755)
        server = PostgresServer(Path(folder), programs, host, port)
        try:
            yield server
        finally:
            server.stop()
