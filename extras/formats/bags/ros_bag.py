"""Imports joint states from bags of ROS 2 (MCAP and SQLite) and ROS 1 as a trace, using the library rosbags.

Messages are decoded only by ROS's own definitions. Those in JSON and protobuf are tables, whose columns the user names.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Literal

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.extras import require_extra
from daq.contracts.import_choice import Choice
from daq.contracts.joint_matching import numbers_by_name, taken_names
from daq.contracts.trace import EARLIEST, INCOMPLETE, LATEST, Floats, Trace, TraceRecord
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces import bounds
from daq.traces.description import Description
from daq.traces.mapping.expression import Table, listed
from daq.traces.mapping.mapped_trace import mapped_trace, selected_rows
from daq.traces.mapping.units import NONE, drive_of
from daq.traces.naming import trace_id_of
from extras.formats.bags.bag_files import check_files
from extras.formats.bags.bag_storage import LARGEST_MESSAGE, Contents, contents
from extras.formats.bags.joint_messages import CONTROLLER_STATE, JOINT_STATE, STATES, JointValues, decoder
from extras.formats.bags.other_messages import message_columns

NO_MEMORY = "is damaged, or needs more memory than it may use (traces.limits.file_bytes and total_bytes)"
Optional = Literal["velocity", "effort", "set_point"]


@dataclass(frozen=True)
class _State:
    """One message. `number` counts those of its topic, from 1; `stamp` and `received` are in ns since 1970."""

    number: int
    received: int
    values: JointValues

    @property
    def stamp(self) -> int:
        return self.values.stamp

    @property
    def names(self) -> tuple[str, ...]:
        return self.values.names


def import_bag(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS, choice: Choice | None = None) -> Trace:
    """Returns the joint states in a bag as a trace: a folder with metadata.yaml, or a file of MCAP, SQLite or ROS 1.

    A TOML file of the same name beside it adds what messages cannot hold. Content that the bag announces but lacks is
    listed in the notes, and the outcome is then `interrupted`.

    This function does not limit memory; `bag_process` does, for untrusted bags. Raises TraceError with one line for a
    path that is no bag, has no joint states, or is inconsistent, and MissingExtraError without rosbags.
    """
    path, choice = Path(path), choice or Choice()
    require_extra("ros", f"{path}: reading a bag", "rosbags")
    path = path if path.name else path.resolve()
    description, described = Description.read(path, limits)
    choice = description.over(choice)
    check_files(path, limits)
    machine = description.load_machine(path)
    found = _contents(path, limits)
    topic = _topic(path, found, choice.topic)
    if found.encoding(topic):
        rows = message_columns(f"{path}: topic {listed([topic])}", found, topic)
        return mapped_trace(path, Table(f"{path}: topic {topic}", rows), choice, description, limits)
    origin = f"{path}: topic {topic}"
    states = _read(path, found, topic)
    asked = None if choice.set_points is None else _read(path, found, _topic(path, found, choice.set_points))
    names = _names(origin, states, choice.joints, limits)
    if choice.joints is None:
        description.names_of(origin, names)
    known = choice.numbering if machine is None else tuple(joint.name for joint in machine.joints)
    names = taken_names(origin, names, machine, known, chosen=choice.joints is not None)
    table = _Table(origin, names, states, found.missing)
    trace = _chosen_rows(table.trace(description.record(path, machine, ""), choice, asked), origin, choice.where)
    description.check_period(trace.time, origin)
    numbers, record = numbers_by_name(names, known), trace.record
    spoken = ", ".join(f"{number} {name}" for number, name in zip(numbers, names, strict=True))
    signals = (trace.time, trace.position, trace.velocity, trace.drive, trace.set_point)
    identity = trace_id_of(
        *(text.encode() for text in (topic, " ".join(names), " ".join(map(str, numbers)), record.created.isoformat())),
        *(b"" if signal is None else signal.tobytes() for signal in signals),
        *described,
    )
    hint = _other_topics(found, topic) if trace.set_point is None else ""
    notes = f"{record.notes} From topic {topic}, joints {spoken}.{hint}".strip()
    told = {"joint_names": names, "joints_chosen": choice.joints is not None, "where": choice.where or ""}
    record = record.model_copy(update={"trace_id": identity, "notes": notes} | told)
    bounds.check_signals({name: getattr(trace, name) for name in bounds.LARGEST}, str(path))
    bounds.check_record(record, (), str(path))
    return replace(trace, record=record, joints=numbers)


def _chosen_rows(trace: Trace, origin: str, where: str | None) -> Trace:
    """Returns a trace's rows within `time=LOW..HIGH`, s from its start. Raises TraceError if none is left."""
    if where is None:
        return trace
    rows = selected_rows(Table(origin, {"time": trace.time}), trace.time, where)
    if not rows.any():
        raise TraceError(f"{origin}: no row is left where {where}")
    signals: dict[str, Any] = {
        name: values[rows] for name, values in vars(trace).items() if isinstance(values, np.ndarray)
    }
    notes = f"{trace.record.notes} Rows where {where}.".strip()
    return replace(trace, record=trace.record.model_copy(update={"notes": notes}), **signals)


def _other_topics(found: Contents, topic: str) -> str:
    """Returns a hint on set points in other topics."""
    others = [name for name in found.messages if found.types[name] == CONTROLLER_STATE and found.messages[name]]
    return (
        f" Its set points are on {listed(others)}: --set-points takes them." if others and topic not in others else ""
    )


def _contents(path: Path, limits: TraceLimits) -> Contents:
    """Returns the content of a bag. Raises TraceError."""
    with _one_error(path):
        return contents(path, limits)


def _read(path: Path, found: Contents, topic: str) -> list[_State]:
    """Returns the joint states of a topic. Raises TraceError."""
    with _one_error(path):
        origin = f"{path}: topic {listed([topic])}"
        return list(_decoded(origin, found.messages[topic], decoder(found.types[topic], found.ros_1)))


@contextmanager
def _one_error(path: Path) -> Iterator[None]:
    """Turns any exception of rosbags on a damaged bag into TraceError."""
    try:
        yield
    except TraceError:
        raise
    except MemoryError as error:
        raise TraceError(f"{path}: {NO_MEMORY}") from error
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {error.strerror or error}") from error
    except Exception as error:
        told = " ".join(str(error).split())[:200] or "it is damaged"
        raise TraceError(f"{path}: cannot be read as a bag ({type(error).__name__}: {told})") from error


def _topic(path: Path, found: Contents, wanted: str | None) -> str:
    """Returns the requested topic, else the only one with messages of the first available type. Raises TraceError."""
    there = sorted(found.messages)
    if not there:
        others = sorted(f"{name} ({kind})" for name, kind in found.types.items())
        raise TraceError(f"{path}: has no topic of {JOINT_STATE}; it has {listed(others) or 'no topic'}")
    if wanted is not None and wanted not in there:
        raise TraceError(f"{path}: topic {listed([wanted])}: has no joint states; topics with some: {listed(there)}")
    if wanted is not None:
        return wanted
    told = [name for name in there if found.messages[name]] or there
    kinds = [*STATES, *{found.types[name] for name in told}]
    first = next(kind for kind in kinds if any(found.types[name] == kind for name in told))
    alike = [name for name in told if found.types[name] == first]
    if len(alike) > 1:
        raise TraceError(f"{path}: has joint states on {listed(alike)}; choose one with --topic")
    return alike[0]


def _decoded(
    origin: str, messages: list[tuple[int, bytes]], decode: Callable[[bytes], JointValues]
) -> Iterator[_State]:
    """Decodes messages. Raises TraceError."""
    for number, (received, raw) in enumerate(messages, start=1):
        place = f"{origin}: message {number}"
        if len(raw) > LARGEST_MESSAGE:
            raise TraceError(f"{place}: has more than {LARGEST_MESSAGE} bytes, too many for joint states")
        try:
            state = _State(number, received, decode(raw))
        except MemoryError:
            raise
        except Exception as error:
            raise TraceError(f"{place}: is not a valid message of its type") from error
        _check_lengths(place, state)
        yield state


def _check_lengths(origin: str, state: _State) -> None:
    count = len(state.names)
    if len(state.values.position) != count:
        raise TraceError(f"{origin}: has {count} names and {len(state.values.position)} positions")
    for name in ("velocity", "effort", "set_point"):
        values = getattr(state.values, name)
        if len(values) not in (0, count):
            raise TraceError(f"{origin}: has {count} names and {len(values)} values of {name}")
    if len(set(state.names)) != count:
        raise TraceError(f"{origin}: names a joint twice: {listed(state.names)}")


def _names(origin: str, states: list[_State], wanted: tuple[str, ...] | None, limits: TraceLimits) -> tuple[str, ...]:
    """Returns the requested joints, else those of all messages. Raises TraceError."""
    sets = Counter(frozenset(state.names) for state in states)
    sets.pop(frozenset(), None)
    if not sets:
        raise TraceError(f"{origin}: has no joint states in {len(states)} messages")
    known = {name: None for state in states for name in state.names}
    if wanted is None:
        if len(sets) > 1:
            kinds = "; ".join(f"{listed(sorted(names))} in {_messages(count)}" for names, count in sets.most_common(3))
            raise TraceError(f"{origin}: has messages of different joints: {kinds}; choose joints with --joints")
        wanted = tuple(known)
    for name in wanted:
        if name not in known:
            raise TraceError(f"{origin}: has no joint {name!r}; it has {listed(list(known))}")
    if not 1 <= len(wanted) <= limits.joints or len(set(wanted)) != len(wanted):
        line = f"choose up to {limits.joints} different ones with --joints (traces.limits.joints)"
        raise TraceError(f"{origin}: {len(wanted)} joints are {listed(wanted)}; {line}")
    if not any(names.issuperset(wanted) for names in sets):
        raise TraceError(f"{origin}: has no message with all of {listed(wanted)}")
    return wanted


class _Table:
    """The messages that have all of some joints, as columns in the order of these joints."""

    def __init__(self, origin: str, names: tuple[str, ...], states: list[_State], missing: list[str]) -> None:
        self._origin = origin
        self._names = names
        self._said = [f"{INCOMPLETE}{line}." for line in missing]
        self._states = self._keep("Messages without all of these joints", states, lambda s: set(names) <= set(s.names))
        self._states = self._keep(
            "Messages with a position that is not a number",
            self._states,
            lambda s: bool(np.isfinite(s.values.position[self._columns(s)]).all()),
        )

    def _columns(self, state: _State) -> list[int]:
        return [state.names.index(name) for name in self._names]

    def _keep(self, what: str, states: list[_State], good: Callable[[_State], bool]) -> list[_State]:
        """Returns the good states and counts the others. Raises TraceError if none is good."""
        kept = [state for state in states if good(state)]
        if len(kept) < len(states):
            first = next(state.number for state in states if not good(state))
            line = f"{what}, left out: {len(states) - len(kept)}, the first is message {first}."
            if not kept:
                raise TraceError(f"{self._origin}: {line} None is left")
            self._said.append(line)
        return kept

    def trace(self, record: TraceRecord, choice: Choice, asked: list[_State] | None) -> Trace:
        """Returns the trace with joints numbered from 1, and notes on omissions. asked: messages of set points.

        Raises TraceError.
        """
        lost = bool(self._said) and self._said[0].startswith(INCOMPLETE)
        moments = self._moments(choice.received)
        set_point = self._optional("set_point") if asked is None else self._asked(asked, moments, choice.received)
        created, time = _since_start(moments[len(moments) - len(self._states) :])
        if not EARLIEST <= created < LATEST:
            raise TraceError(f"{self._origin}: its times are outside the years 1970 to 2261; --received uses others")
        velocity, drive = self._optional("velocity"), self._optional("effort")
        unit = None if choice.drive_unit is None else drive_of(choice.drive_unit, self._origin)
        if unit == NONE:
            drive = None
        elif drive is not None and unit is None:
            line = "its effort may be in N·m, as ROS defines it, or in amperes, as many drivers send it"
            raise TraceError(f"{self._origin}: {line}; give --drive-unit N·m, N, A or V, or none to leave it out")
        update: dict[str, Any] = {"notes": " ".join([record.notes, *self._said]).strip(), "created": created}
        update |= {"drive_unit": unit if drive is not None else None} | ({"outcome": "interrupted"} if lost else {})
        numbers = tuple(range(1, len(self._names) + 1))
        position = self._stacked("position")
        return Trace(
            record.model_copy(update=update), numbers, time, position, set_point, drive=drive, velocity=velocity
        )

    def _asked(self, asked: list[_State], moments: list[int], received: bool) -> Floats:
        """Returns the set points of another topic, each held until the next; states before the first are left out.

        Raises TraceError if that topic lacks a joint or nothing remains.
        """
        known = [s for s in asked if set(self._names) <= set(s.names)]
        if not known:
            raise TraceError(f"{self._origin}: no message of the set points has all of {listed(self._names)}")
        by_arrival = received or not all(state.stamp for state in known)
        since = np.array([state.received if by_arrival else state.stamp for state in known])
        rows = np.searchsorted(since, np.array(moments), side="right") - 1
        numbers = [state.number for state in self._states]
        early = {number for number, row in zip(numbers, rows, strict=True) if row < 0}
        self._states = self._keep("Messages before the first set point", self._states, lambda s: s.number not in early)
        values = [s.values.set_point if len(s.values.set_point) else s.values.position for s in known]
        return np.array([values[row][self._columns(known[row])] for row in rows if row >= 0])

    def _moments(self, received: bool) -> list[int]:
        """Returns the time (ns since 1970) of each sample; a message with the time of the previous one is left out.

        Raises TraceError if times decrease.
        """
        stamped = all(state.stamp for state in self._states)
        received = received or not stamped
        if received:
            self._said.append("Times are those at which messages were received.")
        moments = {state.number: state.received if received else state.stamp for state in self._states}
        for before, state in zip(self._states, self._states[1:], strict=False):
            if moments[state.number] < moments[before.number]:
                now, then = moments[state.number] / 1e9, moments[before.number] / 1e9
                line = f"its time {now:.9f} s does not come after {then:.9f} s"
                hint = "; --received uses the times at which messages were received"
                raise TraceError(f"{self._origin}: message {state.number}: {line}{hint}")
        again = {
            state.number
            for before, state in zip(self._states, self._states[1:], strict=False)
            if moments[state.number] == moments[before.number]
        }
        self._states = self._keep(
            "Messages with the time of the previous one", self._states, lambda state: state.number not in again
        )
        return [moments[state.number] for state in self._states]

    def _optional(self, name: Optional) -> Floats | None:
        """Returns a signal that messages may lack, or fill with NaN; None if any of them lacks it."""
        lacking = sum(len(getattr(state.values, name)) == 0 for state in self._states)
        if lacking == 0:
            found = self._stacked(name)
            finite = np.isfinite(found).all(axis=1)
            if finite.all():
                return found
            lacking = int((~finite).sum())
        if lacking < len(self._states):
            self._said.append(f"{name} was left out: {lacking} of {len(self._states)} messages lack it.")
        return None

    def _stacked(self, name: Literal["position", "velocity", "effort", "set_point"]) -> Floats:
        return np.array([getattr(state.values, name)[self._columns(state)] for state in self._states])


def _since_start(moments: list[int]) -> tuple[datetime, Floats]:
    """Returns the time of the first sample, to the microsecond, and the time (s) of each since then."""
    start = moments[0] // 1000 * 1000
    try:
        created = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=start // 1000)
    except OverflowError:
        created = LATEST
    return created, np.array([moment - start for moment in moments], np.float64) / 1e9


def _messages(count: int) -> str:
    return f"{count} message" if count == 1 else f"{count} messages"
