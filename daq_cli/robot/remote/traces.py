"""Traces of a service."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from daq.contracts.errors import TraceError
from daq.contracts.frozen import like
from daq.contracts.service.archive import Transfer
from daq.contracts.service.traces import CatalogueEntry
from daq.traces.catalogue import TraceSummary
from daq_cli.app.context import Invocation, console
from daq_cli.app.progress import shown_progress
from daq_cli.robot.remote.connection import remote_robot


def fetched_trace(call: Invocation, folder: Path, wanted: str) -> Path:
    """Returns the file of a service's trace in `folder`, downloaded unless it exists. Raises TraceError."""
    with remote_robot(call) as robot:
        entry = robot.traces.find(wanted)
        target = folder / Path(entry.file).name
        if target.is_file() and target.stat().st_size == entry.size:
            return target
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise TraceError(f"{folder}: cannot be made: {error.strerror}") from error
        with fetch_progress(entry.file) as progress:
            path = robot.traces.download(entry.id, target, progress)
    console().print(f"fetched {path}")
    return path


@contextmanager
def fetch_progress(file: str) -> Iterator[Callable[[Transfer], None]]:
    """Shows the progress while the service fetches a trace from its archive; nothing before that."""
    with ExitStack() as shown:
        bars: list[Callable[[float, str], None]] = []

        def tell(transfer: Transfer) -> None:
            if not bars:
                bars.append(shown.enter_context(shown_progress(f"fetching {file} from the archive")))
            bars[0](transfer.done / max(1, transfer.total), transfer_words(transfer))

        yield tell


def transfer_words(transfer: Transfer) -> str:
    """Returns the progress of a transfer, or what it waits for."""
    return transfer.problem or f"{transfer.done / 1e6:.1f} of {transfer.total / 1e6:.1f} MB"


def summary(entry: CatalogueEntry) -> TraceSummary:
    """Converts an entry of the service's catalogue to the form of `daq traces ls`."""
    return like(
        TraceSummary,
        entry,
        path=Path(entry.file),
        state="unreadable" if entry.missing else "finished",
        problem="its file is gone" if entry.missing else None,
        trace_id=entry.id,
        moved=entry.moved or None,
    )
