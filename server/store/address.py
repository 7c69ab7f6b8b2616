"""The database address in the configuration, checked before anything is opened."""

from __future__ import annotations

from pathlib import Path

from sqlalchemy import Engine, create_engine
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError, NoSuchModuleError

from daq.config.service import ServiceSettings
from daq.config.settings import Settings
from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from server.store.databases import added_databases, database_of

EXAMPLE = "sqlite:////srv/arm/service.sqlite"


def address_of(section: ServiceSettings) -> URL:
    """Returns the address of a service's database: the configured one, otherwise that of a file in the service's
    folder. Raises SpecError."""
    if section.database:
        return parse_address(section.database)
    return file_address(section.folder.absolute() / "service.sqlite")


def file_address(file: Path) -> URL:
    """Returns the address of a SQLite file. Without quoting, `?`, `#` and `%` in folder names would be URL syntax."""
    return URL.create("sqlite", database=str(file))


def parse_address(url: str | URL) -> URL:
    """Parses a database address. Raises SpecError if it is invalid, or of an unknown kind of database.

    No error repeats a password.
    """
    try:
        parsed = make_url(url)
        kind = parsed.get_backend_name()
    except (ArgumentError, ValueError) as error:
        raise _no_address(url) from error
    if kind not in ("sqlite", *added_databases()):
        raise _no_address(url)
    try:
        parsed.get_dialect()
    except NoSuchModuleError as error:
        raise _no_address(url) from error
    except ModuleNotFoundError as error:
        raise _no_driver(parsed, error) from error
    return parsed


def masked(url: URL) -> str:
    """Returns an address without its password, even if that is a parameter, for messages."""
    query = {name: "hidden" if "pass" in name.lower() else value for name, value in url.query.items()}
    return url.set(query=query).render_as_string()


def masked_settings(settings: Settings) -> Settings:
    """Returns settings for display, without the password of the database."""
    if settings.server.database is None:
        return settings
    try:
        shown_address = masked(make_url(settings.server.database))
    except ArgumentError:
        shown_address = "hidden: is not the address of a database"
    section = settings.server.model_copy(update={"database": shown_address})
    return settings.model_copy(update={"server": section})


def open_engine(url: str | URL) -> Engine:
    """Makes the engine of a database, which connects on first use. Raises SpecError; if a driver is missing, the error
    names the package to install."""
    parsed = parse_address(url)
    try:
        # Replace a connection that its server has closed meanwhile.
        return create_engine(parsed, pool_pre_ping=parsed.get_backend_name() != "sqlite")
    except ModuleNotFoundError as error:
        raise _no_driver(parsed, error) from error
    except (ArgumentError, TypeError, ValueError) as error:
        line = f"server.database {masked(parsed)}: cannot be used: {error}"
        raise SpecError(line) from error


def _no_address(url: str | URL) -> SpecError:
    known = shown(str(url).rpartition("@")[2])
    return SpecError(f"server.database {known}: is not the address of a database; write {EXAMPLE}")


def _no_driver(parsed: URL, error: ModuleNotFoundError) -> SpecError:
    module = error.name or parsed.drivername
    package = database_of(parsed.get_backend_name()).packages.get(module, module)
    return SpecError(
        f"server.database {masked(parsed)}: its driver {module} is not installed: "
        f"`pip install '{package}'` where daq is installed"
    )
