"""Counts what is asked again and again, so that it fills no disk: heartbeats, jogging, refused requests."""

from __future__ import annotations

from dataclasses import dataclass

from daq.contracts.service.audit import AuditNote

COUNTED_FOR = 60.0
"""Time (s) for which repeated requests are counted before a row says how many there were."""
MOST_KEYS = 1000
"""Number of different repeated requests that are told apart; further ones are counted together."""
Key = tuple[object, ...]


@dataclass
class _Counted:
    """Requests of one key since the last row about them, the last one's note, and when counting began (s)."""

    count: int
    note: AuditNote
    since: float


class Repeats:
    """The requests that are counted now. For one thread."""

    def __init__(self) -> None:
        self._counted: dict[Key, _Counted] = {}

    def take(self, note: AuditNote, now: float) -> AuditNote | None:
        """Returns the note if it is the first of its kind; otherwise None, and it is counted."""
        key = _key(note)
        known = self._counted.get(key)
        if known is None and len(self._counted) >= MOST_KEYS:
            key = (note.outcome,)
            known = self._counted.get(key)
        if known is None:
            self._counted[key] = _Counted(0, note, now)
            return note
        known.count, known.note = known.count + 1, note
        return None

    def due(self, now: float) -> list[AuditNote]:
        """Returns a note for each kind that was counted for COUNTED_FOR s. Kinds that have ended are forgotten."""
        found = []
        for key, counted in list(self._counted.items()):
            if now - counted.since < COUNTED_FOR:
                continue
            if counted.count:
                found.append(counted.note.model_copy(update={"count": counted.count}))
                counted.count, counted.since = 0, now
            else:
                del self._counted[key]
        return found

    def rest(self) -> list[AuditNote]:
        """Returns what is counted now, and forgets it, because the service ends."""
        counted, self._counted = self._counted, {}
        return [one.note.model_copy(update={"count": one.count}) for one in counted.values() if one.count]


def _key(note: AuditNote) -> Key:
    return note.actor, note.origin, note.action, note.robot, note.outcome, note.status
