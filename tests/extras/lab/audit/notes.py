"""Notes of an audit log that nobody has asked for."""

from datetime import UTC, datetime, timedelta

from daq.contracts.service.audit import AuditNote

BEGUN = datetime(2026, 3, 1, 8, 0, 0, 123456, tzinfo=UTC)


def made_note(number: int = 1, **changes: object) -> AuditNote:
    """Returns a note of a submission, `number` seconds after the others began."""
    return AuditNote(
        **{
            "at": BEGUN + timedelta(seconds=number),
            "actor": "anna",
            "role": "operator",
            "origin": "10.0.0.7",
            "action": "submit_experiment",
            "request": "POST /api/v1/robots/ma2000/experiments",
            "robot": "ma2000",
            "subject": f"{number:012x}",
            "outcome": "done",
            "status": 201,
            "content": '{"priority":1}',
            "request_id": f"{number:016x}",
            **changes,
        }
    )
