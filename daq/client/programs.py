"""Taught programs stored by the service."""

from __future__ import annotations

from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict

from daq.client.connection import Connection, Request
from daq.contracts.service.teaching import ProgramEntry

Content = TypeVar("Content", bound=BaseModel)


class _Kept(BaseModel):
    model_config = ConfigDict(extra="ignore")

    entry: ProgramEntry
    program: dict[str, Any]


class Programs:
    """Lists, reads, stores and deletes programs. Their content is a `daq.teaching.Program`; the caller passes that
    class."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
        self._path = f"{robot}/programs"

    def list(self) -> tuple[ProgramEntry, ...]:
        """Returns the programs, most recently changed first."""
        return self._connection.get(tuple[ProgramEntry, ...], self._path)

    def get(self, kind: type[Content], name: str) -> tuple[Content, ProgramEntry]:
        """Returns a program, parsed as `kind`, with the revision that a change must state. Raises ServiceError."""
        found = self._connection.get(_Kept, f"{self._path}/{name}")
        return kind.model_validate(found.program), found.entry

    def put(self, program: BaseModel, name: str, *, revision: int | None = None) -> ProgramEntry:
        """Stores a new program as `name`, or changes the existing one of that `revision`.

        If the program contains another name, the stored one is renamed. Raises ServiceError if that revision is not the
        newest.
        """
        query = {} if revision is None else {"revision": revision}
        request = Request("PUT", f"{self._path}/{name}", program, query=query, repeatable=True)
        return self._connection.ask(ProgramEntry, request)

    def delete(self, name: str) -> None:
        """Deletes a program permanently."""
        self._connection.do(Request("DELETE", f"{self._path}/{name}"))
