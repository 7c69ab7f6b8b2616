"""Joint states in bags of ROS 2 (MCAP and SQLite) and ROS 1, decoded as a trace by the library rosbags.

Only messages of the type sensor_msgs/JointState are decoded, and only by the definition that ROS has of them: what a
bag says about its types is never run.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.extras import require_extra
from daq.contracts.joint_matching import other_joints
from daq.contracts.trace import EARLIEST, INCOMPLETE, LATEST, Floats, Trace, TraceRecord
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces import bounds
from daq.traces.description import Description, DriveUnit
from daq.traces.kinds import Choice
from daq.traces.naming import trace_id_of
from extras.formats.bags.bag_files import check_files
from extras.formats.bags.bag_storage import JOINT_STATE, LARGEST_MESSAGE, Contents, contents

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


def import_bag(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS, choice: Choice | None = None) -> Trace:
    """The joint states in a bag as a trace: a folder with metadata.yaml, or a file of MCAP, SQLite or ROS 1.

    A TOML file of the same name beside it holds what messages cannot. What the bag promises and does not hold is told
    in the notes, and the outcome is then `interrupted`.

    Nothing here limits the memory that a bag takes: `bag_process` does, for the bags of strangers.
    Raises TraceError with one line for anything that is no bag, holds no joint states, or contradicts itself, and
    MissingExtraError where rosbags is not installed.
    """
    path, choice = Path(path), choice or Choice()
    require_extra("ros", f"{path}: reading a bag", "rosbags")
    path = path if path.name else path.resolve()
    description, described = BagDescription.read(path, limits)
    check_files(path, limits)
    machine = description.load_machine(path)
    chosen = description.joints if choice.joints is None else choice.joints
    found_topic, states, missing = _states(path, choice.topic or description.topic, limits)
    origin = f"{path}: topic {found_topic}"
    names = _names(origin, states, chosen, limits)
    known = choice.numbering if machine is None else tuple(joint.name for joint in machine.joints)
    if machine is not None and chosen is None and len(names) > 1 and not set(names) <= set(known):
        raise other_joints(origin, _in_order(names), names, machine.name, known)
    unit = choice.drive_unit or description.drive_unit
    table = _Table(origin, names, states, missing)
    trace = table.trace(description.record(path, machine, ""), choice.times or description.times, unit)
    description.check_period(trace.time, origin)
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
    told = {"joint_names": names, "joints_chosen": chosen is not None}
    record = record.model_copy(update={"trace_id": identity, "notes": notes} | told)
    bounds.check_signals({name: getattr(trace, name) for name in bounds.LARGEST}, str(path))
    bounds.check_record(record, (), str(path))
    return Trace(record, numbers, trace.time, trace.position, velocity=trace.velocity, drive=trace.drive)


def _states(path: Path, topic: str | None, limits: TraceLimits) -> tuple[str, list[_State], list[str]]:
    """The joint states of a topic, and what of them is missing. Raises TraceError."""
    try:
        found = contents(path, limits)
        name = _topic(path, found, topic)
        states = _decoded(f"{path}: topic {_listed([name])}", found.messages[name], found.ros_1)
        return name, list(states), found.missing
    except TraceError:
        raise
    except MemoryError as error:
        raise TraceError(f"{path}: {NO_MEMORY}") from error
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {error.strerror or error}") from error
    except Exception as error:  # a damaged bag makes rosbags and what it uses raise anything
        told = " ".join(str(error).split())[:200] or "it is damaged"
        raise TraceError(f"{path}: cannot be read as a bag ({type(error).__name__}: {told})") from error


def _topic(path: Path, found: Contents, wanted: str | None) -> str:
    """The topic with joint states: the one that is wanted, else the only one with messages. Raises TraceError."""
    there = sorted(found.messages)
    if not there:
        others = sorted(f"{name} ({kind})" for name, kind in found.types.items())
        raise TraceError(f"{path}: has no topic of {JOINT_STATE}; it has {_listed(others) or 'no topic'}")
    if wanted is not None and wanted not in there:
        raise TraceError(f"{path}: topic {_listed([wanted])}: has no joint states; there are some on {_listed(there)}")
    told = [name for name in there if found.messages[name]] or there
    if wanted is None and len(told) > 1:
        raise TraceError(f"{path}: has joint states on {_listed(told)}; choose one with --topic")
    return wanted or told[0]


def _decoded(origin: str, messages: list[tuple[int, bytes]], ros_1: bool) -> Iterator[_State]:
    """Decodes messages. Raises TraceError."""
    decode = _decoder(ros_1)
    for number, (received, raw) in enumerate(messages, start=1):
        place = f"{origin}: message {number}"
        if len(raw) > LARGEST_MESSAGE:
            raise TraceError(f"{place}: has more than {LARGEST_MESSAGE} bytes; joint states have not")
        try:
            message = decode(raw, JOINT_STATE)
        except MemoryError:
            raise
        except Exception as error:
            raise TraceError(f"{place}: is no {JOINT_STATE}") from error
        state = _State(
            number,
            message.header.stamp.sec * 10**9 + message.header.stamp.nanosec,
            received,
            tuple(message.name),
            *(np.array(values, np.float64) for values in (message.position, message.velocity, message.effort)),
        )
        _check_lengths(place, state)
        yield state


@cache
def _decoder(ros_1: bool) -> Callable[[bytes, str], Any]:
    """What decodes a message. It knows ROS's definitions alone, whatever a bag says of its types."""
    from rosbags.typesys import Stores, get_typestore

    if ros_1:
        return get_typestore(Stores.ROS1_NOETIC).deserialize_ros1
    return get_typestore(Stores.ROS2_JAZZY).deserialize_cdr


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

    def __init__(self, origin: str, names: tuple[str, ...], states: list[_State], missing: list[str]) -> None:
        self._origin = origin
        self._names = names
        self._said = [f"{INCOMPLETE}{line}." for line in missing]
        self._states = self._keep("Messages without all of these joints", states, lambda s: set(names) <= set(s.names))
        self._states = self._keep(
            "Messages with a position that is no number",
            self._states,
            lambda s: bool(np.isfinite(s.position[self._columns(s)]).all()),
        )

    def _columns(self, state: _State) -> list[int]:
        return [state.names.index(name) for name in self._names]

    def _keep(self, what: str, states: list[_State], good: Callable[[_State], bool]) -> list[_State]:
        """The states that are good; the others are counted. Raises TraceError where none is."""
        kept = [state for state in states if good(state)]
        if len(kept) < len(states):
            first = next(state.number for state in states if not good(state))
            line = f"{what}, left out: {len(states) - len(kept)}, the first is message {first}."
            if not kept:
                raise TraceError(f"{self._origin}: {line} None is left")
            self._said.append(line)
        return kept

    def trace(self, record: TraceRecord, times: Times | None, unit: DriveUnit | Literal["none"] | None) -> Trace:
        """The trace with joints numbered from 1, and notes on what was left out. Raises TraceError."""
        lost = bool(self._said) and self._said[0].startswith(INCOMPLETE)
        moments = self._moments(times)
        created, time = _since_start(moments)
        if not EARLIEST <= created < LATEST:
            raise TraceError(f"{self._origin}: its times are not of the years 1970 to 2261; --received takes others")
        velocity, effort = self._optional("velocity"), self._optional("effort")
        if effort is not None and unit is None:
            line = "its effort may be in N·m, as ROS defines it, or in amperes, as many drivers send it"
            raise TraceError(f"{self._origin}: {line}; say --drive-unit N·m, N, A or V, or none to leave it out")
        drive = None if unit == "none" else effort
        update: dict[str, Any] = {"notes": " ".join([record.notes, *self._said]).strip(), "created": created}
        update |= {"drive_unit": unit if drive is not None else None} | ({"outcome": "interrupted"} if lost else {})
        numbers = tuple(range(1, len(self._names) + 1))
        position = self._stacked("position")
        return Trace(record.model_copy(update=update), numbers, time, position, velocity=velocity, drive=drive)

    def _moments(self, times: Times | None) -> list[int]:
        """Time (ns since 1970) of each sample; a message with the time of the one before is left out.

        Raises TraceError where a time goes back.
        """
        stamped = all(state.stamp for state in self._states)
        if times == "stamped" and not stamped:
            number = next(state.number for state in self._states if not state.stamp)
            raise TraceError(f"{self._origin}: message {number}: has no stamp; --received takes other times")
        received = times == "received" or not stamped
        if received:
            self._said.append("Times are those at which messages were received.")
        moments = {state.number: state.received if received else state.stamp for state in self._states}
        for before, state in zip(self._states, self._states[1:], strict=False):
            if moments[state.number] < moments[before.number]:
                now, then = moments[state.number] / 1e9, moments[before.number] / 1e9
                line = f"its time {now:.9f} s does not come after {then:.9f} s"
                hint = "; --received takes the times at which messages were received"
                raise TraceError(f"{self._origin}: message {state.number}: {line}{hint}")
        again = {
            state.number
            for before, state in zip(self._states, self._states[1:], strict=False)
            if moments[state.number] == moments[before.number]
        }
        self._states = self._keep(
            "Messages with the time of the one before", self._states, lambda state: state.number not in again
        )
        return [moments[state.number] for state in self._states]

    def _optional(self, name: Optional) -> Floats | None:
        """A signal that messages may lack, or fill with NaN; None where one of them does."""
        lacking = sum(len(getattr(state, name)) == 0 for state in self._states)
        if lacking == 0:
            found = self._stacked(name)
            finite = np.isfinite(found).all(axis=1)
            if finite.all():
                return found
            lacking = int((~finite).sum())
        if lacking < len(self._states):
            self._said.append(f"{name} was left out: {lacking} of {len(self._states)} messages lack it.")
        return None

    def _stacked(self, name: Literal["position", "velocity", "effort"]) -> Floats:
        return np.array([getattr(state, name)[self._columns(state)] for state in self._states])


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
    shown = ", ".join("".join(c if c.isprintable() else "?" for c in name[:60]) for name in names[:SHOWN])
    return shown if len(names) <= SHOWN else f"{shown} and {len(names) - SHOWN} more"
