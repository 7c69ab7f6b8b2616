"""Who the service is at the store: from a file, or from the environment. Never from a request."""

from __future__ import annotations

import os
from collections.abc import Mapping

from pydantic import SecretStr, ValidationError

from daq.contracts.documents import parse_toml, read_text
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from extras.lab.archive.settings import ArchiveSettings

ACCESS_KEY, SECRET_KEY, SESSION_TOKEN = "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN"
"""Environment variables that every client of S3 knows."""


class Credentials(FrozenRecord):
    """The two halves of a key, and the token of one that lasts for a session. Their `repr` shows none of them."""

    access_key: SecretStr
    secret_key: SecretStr
    session_token: SecretStr | None = None


def load_credentials(settings: ArchiveSettings, environment: Mapping[str, str] | None = None) -> Credentials:
    """Reads the credentials. Raises SpecError in one line, which repeats none of them."""
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
        # The words of a parser may repeat what it could not read.
        raise SpecError(f'{what}: is not TOML; write access_key = "…" and secret_key = "…", one a line') from None
    try:
        found = Credentials.model_validate(data)
    except ValidationError as error:
        names = ", ".join(str(one["loc"][0]) for one in error.errors()[:5])
        raise SpecError(f"{what}: {names}: allowed are access_key, secret_key and session_token, as text") from None
    if not found.access_key.get_secret_value() or not found.secret_key.get_secret_value():
        raise SpecError(f"{what}: access_key or secret_key is empty")
    return found
