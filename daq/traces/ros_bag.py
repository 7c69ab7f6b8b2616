"""Joint states in bags of ROS 2 (MCAP and SQLite) and ROS 1, read as a trace with the library rosbags.

Only messages of the type sensor_msgs/JointState are decoded, and only by the definition that ROS has of them: what a
bag says about its types is never run.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.extras import require_extra
from daq.contracts.trace import EARLIEST, LATEST, Floats, Trace, TraceRecord
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces import bounds
from daq.traces.bag_files import check_files
from daq.traces.description import Description
from daq.traces.naming import trace_id_of

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2

JOINT_STATE = "sensor_msgs/msg/JointState"
LARGEST_MESSAGE = 1 << 20
"""Largest message (bytes) of joint states: that of some ten thousand joints."""
NO_MEMORY = "is damaged, or needs more memory than it may use (traces.limits.file_bytes and total_bytes)"
SHOWN = 8
"""Number of names that an error lists."""

Times = Literal["stamped", "received"]
Optional = Literal["velocity", "effort"]


class BagDescription(Description):
    """The TOML beside a bag."""

    topic: str | None = None
    """Topic of the joint states; None where the bag has one only."""
    joints: tuple[str, ...] | None = None
    """Names of the joints to take, in this order; all of them when None."""
    times: Times | None = None
    """Times of the samples: those in the messages, or those at which the messages were received."""


@dataclass(frozen=True)
class _State:
    """One message. `number` counts those of its topic, from 1; `stamp` and `received` are in ns since 1970."""

    number: int
    stamp: int
    received: int
    names: tuple[str, ...]
    position: Floats
    velocity: Floats
    effort: Floats


def import_bag(
    path: Path,
    limits: TraceLimits = DEFAULT_TRACE_LIMITS,
    *,
    topic: str | None = None,
    joints: tuple[str, ...] | None = None,
    times: Times | None = None,
    numbering: tuple[str, ...] = (),
) -> Trace:
    """The joint states in a bag as a trace: a folder with metadata.yaml, or an .mcap, .db3 or .bag file.

    A TOML file of the same name beside it holds what messages cannot; the arguments go before it.

    Args:
        topic: of the joint states; needed where a bag has several.
        joints: names of the joints to take, in the order of the trace's joints; messages without them are left out.
        times: `received` takes the times at which messages were received, in place of those in the messages.
        numbering: names of a machine's joints 1, 2 …, for a bag whose TOML names no machine.

    Nothing here limits the memory that rosbags takes: `daq.traces.bag_process` does, for the bags of strangers.
    Raises TraceError with one line for anything that is no bag, holds no joint states, or contradicts itself, and
    MissingExtraError where rosbags is not installed.
    """
    path = Path(path)
    require_extra("ros", f"{path}: reading a bag", "rosbags")
    path = path if path.name else path.resolve()
    description, described = BagDescription.read(path, limits)
    check_files(path, limits)
    machine = description.load_machine(path)
    chosen = description.joints if joints is None else joints
    found_topic, states = _states(path, topic or description.topic, limits)
    names = _names(f"{path}: topic {found_topic}", states, chosen, limits)
    trace = _Table(f"{path}: topic {found_topic}", names, states).trace(
        description.record(path, machine, ""), times or description.times
    )
    known = numbering if machine is None else tuple(joint.name for joint in machine.joints)
    numbers, record = _numbers(names, known), trace.record
    spoken = ", ".join(f"{number} {name}" for number, name in zip(numbers, names, strict=True))
    signals = (trace.time, trace.position, trace.velocity, trace.drive)
    identity = trace_id_of(
        *(text.encode() for text in (found_topic, " ".join(names), record.created.isoformat())),
        *([] if machine is not None or numbers == _in_order(names) else [" ".join(map(str, numbers)).encode()]),
        *(b"" if signal is None else signal.tobytes() for signal in signals),
        *described,
    )
    notes = f"{record.notes} From topic {found_topic}, joints {spoken}.".strip()
    record = record.model_copy(update={"trace_id": identity, "notes": notes})
    bounds.check_signals({name: getattr(trace, name) for name in bounds.LARGEST}, str(path))
    bounds.check_record(record, (), str(path))
    return Trace(record, numbers, trace.time, trace.position, velocity=trace.velocity, drive=trace.drive)


def _states(path: Path, topic: str | None, limits: TraceLimits) -> tuple[str, list[_State]]:
    """The joint states of a topic. Raises TraceError."""
    try:
        with ExitStack() as stack:
            reader, ros_1 = _opened(path, stack)
            connections = _connections(path, reader, topic)
            return connections[0].topic, list(_decoded(path, reader, connections, limits, ros_1))
    except TraceError:
        raise
    except MemoryError as error:
        raise TraceError(f"{path}: {NO_MEMORY}") from error
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {error.strerror or error}") from error
    except Exception as error:  # a damaged bag makes rosbags and what it uses raise anything
        told = " ".join(str(error).split())[:200] or "it is damaged"
        raise TraceError(f"{path}: cannot be read as a bag ({type(error).__name__}: {told})") from error


def _opened(path: Path, stack: ExitStack) -> tuple[Reader1 | Reader2, bool]:
    """The reader of a bag, and whether the bag is of ROS 1."""
    if path.suffix == ".bag" and not path.is_dir():
        from rosbags import rosbag1

        return stack.enter_context(rosbag1.Reader(path)), True
    from rosbags import rosbag2

    return stack.enter_context(rosbag2.Reader(path)), False


def _connections(path: Path, reader: Reader1 | Reader2, topic: str | None) -> list[Connection]:
    """The connections of the topic with joint states. Raises TraceError where it is not one topic."""
    there = [one for one in reader.connections if one.msgtype == JOINT_STATE]
    topics = sorted({one.topic for one in there})
    if not there:
        others = sorted({f"{one.topic} ({one.msgtype})" for one in reader.connections})
        raise TraceError(f"{path}: has no topic of {JOINT_STATE}; it has {_listed(others) or 'no topic'}")
    if topic is None and len(topics) > 1:
        raise TraceError(f"{path}: has joint states on {_listed(topics)}; choose one with --topic")
    if topic is not None and topic not in topics:
        raise TraceError(f"{path}: topic {topic}: has no joint states; there are some on {_listed(topics)}")
    return [one for one in there if one.topic == (topic or topics[0])]


def _decoded(
    path: Path, reader: Reader1 | Reader2, connections: list[Connection], limits: TraceLimits, ros_1: bool
) -> Iterator[_State]:
    """Decodes the messages of a topic. Raises TraceError, and whatever rosbags does."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros_1 else Stores.ROS2_JAZZY)
    decode: Any = store.deserialize_ros1 if ros_1 else store.deserialize_cdr
    for number, (connection, received, raw) in enumerate(reader.messages(connections=connections), start=1):
        origin = f"{path}: topic {connection.topic}: message {number}"
        if number > limits.records:
            raise TraceError(f"{origin}: up to {limits.records} are read (traces.limits.records)")
        if len(raw) > LARGEST_MESSAGE:
            raise TraceError(f"{origin}: has {len(raw)} bytes; joint states have up to {LARGEST_MESSAGE}")
        try:
            message: Any = decode(raw, JOINT_STATE)
        except MemoryError:
            raise
        except Exception as error:
            raise TraceError(f"{origin}: is no {JOINT_STATE}") from error
        state = _State(
            number,
            message.header.stamp.sec * 10**9 + message.header.stamp.nanosec,
            received,
            tuple(message.name),
            *(np.array(values, np.float64) for values in (message.position, message.velocity, message.effort)),
        )
        _check_lengths(origin, state)
        yield state


def _check_lengths(origin: str, state: _State) -> None:
    count = len(state.names)
    if len(state.position) != count:
        raise TraceError(f"{origin}: has {count} names and {len(state.position)} positions")
    for name in ("velocity", "effort"):
        values = getattr(state, name)
        if len(values) not in (0, count):
            raise TraceError(f"{origin}: has {count} names and {len(values)} values of {name}")
    if len(set(state.names)) != count:
        raise TraceError(f"{origin}: names a joint twice: {_listed(state.names)}")


def _names(origin: str, states: list[_State], wanted: tuple[str, ...] | None, limits: TraceLimits) -> tuple[str, ...]:
    """The joints to take: those that are wanted, else those of all messages. Raises TraceError."""
    sets = Counter(frozenset(state.names) for state in states)
    sets.pop(frozenset(), None)
    if not sets:
        raise TraceError(f"{origin}: has no joint states in {len(states)} messages")
    known = {name: None for state in states for name in state.names}
    if wanted is None:
        if len(sets) > 1:
            kinds = "; ".join(f"{_listed(sorted(names))} in {_messages(count)}" for names, count in sets.most_common(3))
            raise TraceError(f"{origin}: has messages of different joints: {kinds}; choose joints with --joints")
        wanted = tuple(known)
    for name in wanted:
        if name not in known:
            raise TraceError(f"{origin}: has no joint {name!r}; it has {_listed(list(known))}")
    if not 1 <= len(wanted) <= limits.joints or len(set(wanted)) != len(wanted):
        line = f"choose up to {limits.joints} different ones with --joints (traces.limits.joints)"
        raise TraceError(f"{origin}: {len(wanted)} joints are {_listed(wanted)}; {line}")
    if not any(names.issuperset(wanted) for names in sets):
        raise TraceError(f"{origin}: has no message with all of {_listed(wanted)}")
    return wanted


class _Table:
    """The messages that have all of some joints, as columns in the order of these joints."""

    def __init__(self, origin: str, names: tuple[str, ...], states: list[_State]) -> None:
        self._origin = origin
        self._names = names
        self._states = [state for state in states if set(names) <= set(state.names)]
        self._left_out = len(states) - len(self._states)
        self._columns = [[state.names.index(name) for name in names] for state in self._states]

    def trace(self, record: TraceRecord, times: Times | None) -> Trace:
        """The trace with joints numbered from 1, and notes on what was left out. Raises TraceError."""
        said = [f"Messages without all of these joints, left out: {self._left_out}."] if self._left_out else []
        moments = self._moments(times, said)
        created, time = _since_start(moments)
        if not EARLIEST <= created < LATEST:
            raise TraceError(f"{self._origin}: its times are not of the years 1970 to 2261; --received takes others")
        velocity, effort = self._optional("velocity", said), self._optional("effort", said)
        update = {"notes": " ".join([record.notes, *said]).strip(), "created": created}
        if effort is not None:
            update["drive_unit"] = record.drive_unit or "N·m"
        numbers = tuple(range(1, len(self._names) + 1))
        position = self._position()
        return Trace(record.model_copy(update=update), numbers, time, position, velocity=velocity, drive=effort)

    def _moments(self, times: Times | None, said: list[str]) -> list[int]:
        """Time (ns since 1970) of each sample. Raises TraceError where it does not increase."""
        stamped = all(state.stamp for state in self._states)
        if times == "stamped" and not stamped:
            number = next(state.number for state in self._states if not state.stamp)
            raise TraceError(f"{self._origin}: message {number}: has no stamp; --received takes other times")
        received = times == "received" or not stamped
        if received:
            said.append("Times are those at which messages were received.")
        moments = [state.received if received else state.stamp for state in self._states]
        for before, after, state in zip(moments, moments[1:], self._states[1:], strict=False):
            if after <= before:
                line = f"its time {after / 1e9:.9f} s does not come after {before / 1e9:.9f} s"
                hint = "" if received else "; --received takes the times at which messages were received"
                raise TraceError(f"{self._origin}: message {state.number}: {line}{hint}")
        return moments

    def _position(self) -> Floats:
        found = self._stacked("position")
        wrong = np.argwhere(~np.isfinite(found))
        if len(wrong):
            row, column = wrong[0]
            value, number = found[row, column], self._states[row].number
            line = f"position of joint {self._names[column]!r} is {value}"
            raise TraceError(f"{self._origin}: message {number}: {line}")
        return found

    def _optional(self, name: Optional, said: list[str]) -> Floats | None:
        """A signal that messages may lack, or fill with NaN; None where one of them does."""
        lacking = sum(len(getattr(state, name)) == 0 for state in self._states)
        if lacking == 0:
            found = self._stacked(name)
            finite = np.isfinite(found).all(axis=1)
            if finite.all():
                return found
            lacking = int((~finite).sum())
        if lacking < len(self._states):
            said.append(f"{name} was left out: {lacking} of {len(self._states)} messages lack it.")
        return None

    def _stacked(self, name: Literal["position", "velocity", "effort"]) -> Floats:
        rows = zip(self._states, self._columns, strict=True)
        return np.array([getattr(state, name)[columns] for state, columns in rows])


def _since_start(moments: list[int]) -> tuple[datetime, Floats]:
    """Moment of the first sample, to the microsecond, and the time (s) of each since then."""
    start = moments[0] // 1000 * 1000
    try:
        created = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=start // 1000)
    except OverflowError:
        created = LATEST
    return created, np.array([moment - start for moment in moments], np.float64) / 1e9


def _numbers(names: tuple[str, ...], known: tuple[str, ...]) -> tuple[int, ...]:
    """Number of each joint: the machine's where it has joints of these names, else from 1 in their order."""
    return tuple(known.index(name) + 1 for name in names) if set(names) <= set(known) else _in_order(names)


def _in_order(names: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(range(1, len(names) + 1))


def _messages(count: int) -> str:
    return f"{count} message" if count == 1 else f"{count} messages"


def _listed(names: list[str] | tuple[str, ...]) -> str:
    shown = ", ".join(str(name)[:60] for name in names[:SHOWN])
    return shown if len(names) <= SHOWN else f"{shown} and {len(names) - SHOWN} more"
