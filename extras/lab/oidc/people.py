"""People who have signed in: a name belongs to the person who first had it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import String, UniqueConstraint, select
from sqlalchemy.orm import DeclarativeBase, Mapped, Session, mapped_column

from daq.contracts.service.queue import Role
from server.access.caller import LOCAL
from server.problems import ProblemError
from server.store.tables import Table


@dataclass(frozen=True)
class Person:
    """A person as the provider identifies them. `subject`: the provider's own ID, which never changes."""

    issuer: str
    subject: str
    name: str
    role: Role


class PeopleTable(DeclarativeBase):
    """Base of the table."""

    type_annotation_map = Table.type_annotation_map


class PersonRow(PeopleTable):
    """Somebody who has signed in, by the name of their first session. `subject`: the provider's ID for them."""

    __tablename__ = "people"
    __table_args__ = (UniqueConstraint("issuer", "subject"),)

    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    issuer: Mapped[str] = mapped_column(String(500))
    subject: Mapped[str] = mapped_column(String(255))
    since: Mapped[datetime]


def name_of(session: Session, person: Person, now: datetime) -> str:
    """Returns the name of a person: that of their first session. Raises a 403 for a name of somebody else."""
    row = session.scalar(select(PersonRow).filter_by(issuer=person.issuer, subject=person.subject))
    if row is None:
        if person.name == LOCAL.name or session.get(PersonRow, person.name) is not None:
            line = f"the name {person.name} belongs to somebody else"
            raise ProblemError(403, "name-taken", line, "choose another claim for names: oidc.name_claim")
        row = PersonRow(name=person.name, issuer=person.issuer, subject=person.subject, since=now)
        session.add(row)
    return row.name
