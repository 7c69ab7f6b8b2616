"""Draws a trace for print: as a figure file or as an HTML page.

matplotlib and Jinja2 are imported only when a plot is made.
"""

from __future__ import annotations

import io
from pathlib import Path

from daq.contracts.errors import TraceError
from daq.contracts.figure import STYLE, figure_of, title_of
from daq.contracts.trace import Trace
from daq.traces import disk

SUFFIXES = (".png", ".svg", ".pdf", ".html")


def plot_trace(trace: Trace, path: Path, joints: tuple[int, ...] | None = None) -> Path:
    """Draws a trace to a PNG, SVG, PDF or self-contained HTML file, by the suffix of `path`. Returns `path`.

    `joints`: joints to draw; None for those that the experiment moves, or all without an experiment. Raises TraceError
    for another suffix, a missing joint, a trace without samples, or a file that cannot be written.
    """
    path = Path(path)
    if path.suffix not in SUFFIXES:
        raise TraceError(f"{path}: plots are made as {', '.join(SUFFIXES)}")
    if len(trace) == 0:
        raise TraceError(f"trace {trace.record.trace_id}: has no samples to plot")
    data = html_page(trace, joints) if path.suffix == ".html" else picture(trace, path.suffix.removeprefix("."), joints)
    try:
        path.write_bytes(data)
    except OSError as error:
        raise TraceError(f"{path}: cannot be written: {disk.reason(error)}") from error
    return path


def picture(trace: Trace, kind: str, joints: tuple[int, ...] | None = None) -> bytes:
    """Returns the figure as `png`, `svg` or `pdf`."""
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        stream = io.BytesIO()
        metadata = {"Date": None} if kind == "svg" else None
        figure_of(trace, joints).savefig(stream, format=kind, dpi=200, facecolor="white", metadata=metadata)
    return stream.getvalue()


def html_page(trace: Trace, joints: tuple[int, ...] | None = None) -> bytes:
    """Returns a self-contained HTML page: the figure, the trace's metadata and its events."""
    from jinja2 import Environment, PackageLoader

    svg = picture(trace, "svg", joints).decode()
    page = Environment(loader=PackageLoader("daq.traces"), autoescape=True).get_template("trace.html.j2")
    return page.render(
        title=title_of(trace), svg=svg[svg.index("<svg") :], facts=_facts(trace), events=trace.events
    ).encode()


def _facts(trace: Trace) -> list[tuple[str, str]]:
    record = trace.record
    facts = [
        ("trace", record.trace_id),
        ("recorded", record.created.strftime("%Y-%m-%d %H:%M:%S UTC")),
        ("robot", record.robot),
        ("source", record.source),
        ("operator", record.operator or "not given"),
        ("joints", ", ".join(str(joint) for joint in trace.joints)),
        ("duration", f"{trace.time[-1] - trace.time[0]:.2f} s"),
        ("samples", f"{len(trace)}, {trace.missing_text}"),
        ("outcome", record.outcome or "not known"),
        ("software", record.software),
        ("notes", record.notes),
    ]
    facts += [(name.replace("_", " "), f"{value:g}") for name, value in record.counters.items()]
    return [(name, value) for name, value in facts if value]
