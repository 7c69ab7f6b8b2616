"""What a record of another tool says of itself."""

from datetime import UTC, datetime

from daq.contracts.trace import TraceRecord


def imported(trace_id: str = "made", **fields: object) -> TraceRecord:
    """The record of an import, with these fields more."""
    stated = {"trace_id": trace_id, "created": datetime(2024, 1, 1, tzinfo=UTC), "software": "test"}
    return TraceRecord.model_validate({**stated, "source": "imported", **fields})
