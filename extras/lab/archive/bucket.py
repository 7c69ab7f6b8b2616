"""Accesses one bucket of an S3 store, through `obstore`. Every error is one line without secrets.

Credentials come from a file or the environment, never from a request. Names of objects let people find a trace, and
different contents never have the same name.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from importlib.util import find_spec
from pathlib import Path
from typing import IO, TYPE_CHECKING

from pydantic import SecretStr, ValidationError

from daq.config.settings import Settings
from daq.contracts import exit_codes
from daq.contracts.documents import parse_toml, read_text
from daq.contracts.errors import DaqError, SpecError
from daq.contracts.frozen import FrozenRecord
from extras.lab.archive.settings import ArchiveSettings

if TYPE_CHECKING:
    from obstore.store import S3Config, S3Store


ACCESS_KEY, SECRET_KEY, SESSION_TOKEN = "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN"
"""Environment variables that every S3 client reads."""


class Credentials(FrozenRecord):
    """The two halves of a key, and the token of a temporary one. Their `repr` shows none of them."""

    access_key: SecretStr
    secret_key: SecretStr
    session_token: SecretStr | None = None


def load_credentials(settings: ArchiveSettings, environment: Mapping[str, str] | None = None) -> Credentials:
    """Reads the credentials. Raises SpecError in one line, without repeating any of them."""
    if settings.credentials is not None:
        return _of_file(settings)
    environment = os.environ if environment is None else environment
    access, secret = environment.get(ACCESS_KEY), environment.get(SECRET_KEY)
    if not access or not secret:
        absent = " and ".join(name for name, value in ((ACCESS_KEY, access), (SECRET_KEY, secret)) if not value)
        raise SpecError(f"archive: no credentials: set {absent} in the environment, or archive.credentials to a file")
    token = environment.get(SESSION_TOKEN)
    return Credentials(
        access_key=SecretStr(access), secret_key=SecretStr(secret), session_token=SecretStr(token) if token else None
    )


def _of_file(settings: ArchiveSettings) -> Credentials:
    assert settings.credentials is not None
    what = f"archive.credentials {settings.credentials}"
    text = read_text(settings.credentials, what)
    try:
        data = parse_toml(text, what)
    except SpecError:
        # A parser's message may repeat text that it could not read.
        raise SpecError(f'{what}: is not TOML; write access_key = "…" and secret_key = "…", one per line') from None
    try:
        found = Credentials.model_validate(data)
    except ValidationError as error:
        names = ", ".join(str(one["loc"][0]) for one in error.errors()[:5])
        raise SpecError(f"{what}: {names}: allowed are access_key, secret_key and session_token, as text") from None
    if not found.access_key.get_secret_value() or not found.secret_key.get_secret_value():
        raise SpecError(f"{what}: access_key or secret_key is empty")
    return found


PLAIN = re.compile(r"[^A-Za-z0-9._-]+")
DIGITS = 16
"""Number of digits of the SHA-256 in a name: 64 bits, so that names of different contents never collide."""
LONGEST = 120
"""Number of characters of the file's name that are kept."""


def object_name(prefix: str, robot: str, file: str, created: datetime, sha256: str) -> str:
    """Returns `PREFIX/ROBOT/YEAR/FILE-SHA256.mcap`, in characters that need no escape in a URL."""
    stem = PLAIN.sub("_", file.removesuffix(".mcap")).strip("._")[:LONGEST] or "trace"
    parts = (prefix, robot, f"{created.astimezone(UTC).year:04d}", f"{stem}-{sha256[:DIGITS]}.mcap")
    return "/".join(part for part in parts if part)


PIECE = 8 << 20
"""Bytes that one request sends or fetches, so that a time limit on a request suits traces of every size."""
AT_ONCE = 2
"""Pieces that are sent at once; few, to limit memory and network load."""
RETRIES, RETRY_WITHIN = 2, timedelta(seconds=10)
"""How often, and for how long, `obstore` repeats a request; after that the service waits longer and tries again."""
STATUS = re.compile(r"\b(?:status(?: code)?:?|error code|server error[^0-9]{0,20})\s*\(?([1-5]\d\d)\b", re.IGNORECASE)
"""Finds the status of an answer in a message of `obstore`."""
REACHING = ("connect", "dns", "tcp", "closed before", "reset by peer", "refused", "error sending request")
Progress = Callable[[int], None]
"""Called with the number of bytes that have been moved so far."""


class ArchiveError(DaqError):
    """The store did not carry out a request. Another attempt may succeed: it is unreachable, slow, or answers
    errors."""

    exit_code = exit_codes.NOT_REACHED


class RefusedError(ArchiveError):
    """The store refuses this service, or its bucket does not exist: a person must look."""


class DamagedError(ArchiveError):
    """The store's object is not the one that was sent: it is missing, shorter, or different."""


@dataclass(frozen=True)
class Content:
    """Size (bytes) and SHA-256 of what was read."""

    size: int
    sha256: str


class Bucket:
    """Accesses objects by their names. Safe to use from any thread; each call waits for the store, up to `timeout` s
    per piece."""

    def __init__(self, settings: ArchiveSettings, credentials: Credentials) -> None:
        from obstore.store import S3Store

        self.place = settings.place
        # Every option is given. obstore would look for others in the environment, and for credentials at the address
        # that Amazon's virtual machines use.
        config: S3Config = {
            "region": settings.region,
            "access_key_id": credentials.access_key.get_secret_value(),
            "secret_access_key": credentials.secret_key.get_secret_value(),
            "checksum_algorithm": "SHA256",
        }
        if credentials.session_token is not None:
            config["session_token"] = credentials.session_token.get_secret_value()
        if settings.endpoint is not None:
            config["endpoint"] = config["aws_endpoint_url_s3"] = settings.endpoint
        self._store: S3Store = S3Store(
            settings.bucket,
            config=config,
            client_options={
                "allow_http": (settings.endpoint or "").startswith("http:"),
                "timeout": timedelta(seconds=settings.timeout),
                "connect_timeout": timedelta(seconds=min(5.0, settings.timeout)),
            },
            retry_config={"max_retries": RETRIES, "retry_timeout": RETRY_WITHIN},
        )

    def send(self, key: str, file: Path, progress: Progress = lambda _done: None) -> Content:
        """Sends a file, and returns its size and digest. Raises OSError if the file cannot be read, ArchiveError."""
        import obstore

        digest, size = hashlib.sha256(), 0

        def pieces(stream: IO[bytes]) -> Iterator[bytes]:
            nonlocal size
            while piece := stream.read(PIECE):
                digest.update(piece)
                size += len(piece)
                yield piece
                progress(size)

        with file.open("rb") as stream:
            is_small = file.stat().st_size <= PIECE
            first = stream.read(PIECE) if is_small else b""
            try:
                if is_small:
                    digest.update(first)
                    size = len(first)
                    obstore.put(self._store, key, first, use_multipart=False)
                    progress(size)
                else:
                    obstore.put(self._store, key, pieces(stream), chunk_size=PIECE, max_concurrency=AT_ONCE)
            except Exception as error:
                raise self._error("keeping a trace", error) from error
        return Content(size, digest.hexdigest())

    def read(
        self, key: str, size: int, take: Callable[[bytes], object], progress: Progress = lambda _: None
    ) -> Content:
        """Reads an object of `size` bytes in pieces, and calls `take` with each.

        Raises as `take` does; DamagedError if the object is missing or has another size; ArchiveError.
        """
        import obstore

        digest, done = hashlib.sha256(), 0
        if self.size_of(key) != size:
            raise DamagedError(f"archive {self.place}: {key} has another size than the file that was sent")
        while done < size:
            try:
                piece = bytes(obstore.get_range(self._store, key, start=done, end=min(size, done + PIECE)))
            except Exception as error:
                raise self._error("reading a trace", error) from error
            if len(piece) != min(size, done + PIECE) - done:
                raise ArchiveError(f"archive {self.place}: reading a trace: the answer was cut short")
            digest.update(piece)
            done += len(piece)
            take(piece)
            progress(done)
        return Content(done, digest.hexdigest())

    def size_of(self, key: str) -> int:
        """Returns the size of an object. Raises DamagedError if there is none, ArchiveError."""
        import obstore

        try:
            return obstore.head(self._store, key)["size"]
        except Exception as error:
            raise self._error("reading a trace", error) from error

    def remove(self, key: str) -> None:
        """Deletes an object; a missing one is no error. Raises ArchiveError."""
        import obstore

        try:
            obstore.delete(self._store, key)
        except FileNotFoundError:
            pass
        except Exception as error:
            raise self._error("deleting a trace", error) from error

    def _error(self, doing: str, error: Exception) -> ArchiveError:
        """Describes an error in words of this program: a store's message may contain names, keys and signatures."""
        kind, why = _reason(error)
        return kind(f"archive {self.place}: {doing}: {why}")


def open_bucket(settings: ArchiveSettings) -> Bucket | None:
    """Opens the archive; None if none is configured. Sends no request yet. Raises SpecError."""
    if settings.bucket is None:
        return None
    if find_spec("obstore") is None:
        install = "`pip install 'ma2000-daq[archive]'` in daq's environment"
        raise SpecError(f"archive.bucket {settings.bucket}: obstore is not installed: {install}")
    try:
        return Bucket(settings, load_credentials(settings))
    except DaqError:
        raise
    except Exception as error:  # noqa: BLE001, whatever it is, its words may repeat the credentials
        raise SpecError(f"archive {settings.place}: cannot be used: {type(error).__name__}") from None


def check(settings: Settings) -> None:
    """Raises SpecError if the configured archive cannot be used."""
    open_bucket(settings.section(ArchiveSettings))


def _reason(error: Exception) -> tuple[type[ArchiveError], str]:
    from obstore import exceptions

    words = str(error)
    low = words.lower().replace("retry_timeout", "")
    status = STATUS.search(words)
    is_reach = any(word in low for word in REACHING)
    reasons: list[tuple[bool, type[ArchiveError], str]] = [
        ("nosuchbucket" in low, RefusedError, "there is no such bucket"),
        (isinstance(error, FileNotFoundError), DamagedError, "the store no longer has it"),
        (
            isinstance(error, exceptions.PermissionDeniedError | exceptions.UnauthenticatedError),
            RefusedError,
            "the store refuses these credentials, or lacks their permission",
        ),
        ("timed out" in low or "timeout" in low, ArchiveError, "no answer in time"),
        (status is not None, ArchiveError, f"the store answers {status[1] if status else ''}"),
        (is_reach, ArchiveError, "cannot be reached"),
    ]
    for is_so, kind, why in reasons:
        if is_so:
            return kind, why
    return ArchiveError, "the store gives no valid answer"
