"""Judges every register, with evidence, and makes a memory map from the verdicts.

It also finds where gains may be (patterns of bytes that hold the gains that errors and powers show), and writes an
incomplete map for a person to complete.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from extras.commissioning.memory.bytes import constants, spread
from extras.commissioning.memory.joint import LEAST_SET_POINTS, JointEvidence, joint_evidence
from extras.commissioning.memory.recording import Recording
from extras.commissioning.memory.relations import Place
from firmware_protocol.memory_map import (
    GAIN_REGISTERS,
    JOINTS,
    MAY_BE_ABSENT,
    MemoryMap,
    Register,
    addresses_text,
    default_memory_map,
)
from firmware_protocol.units import GAIN_MAX

Columns = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
"""Offsets of P, I and D of every joint."""


def gain_columns(held: NDArray[np.int64], measured: Sequence[int | None]) -> list[Columns]:
    """Returns every regular pattern whose P bytes hold the `measured` gains and whose I and D bytes hold 0.

    A pattern is three rows, equally far apart, or a record of P, I and D for each joint. If I or D is not 0, a power is
    not proportional to its error, and there is no measured gain.

    held: the constant value of each byte, -1 where it cannot be a gain
    """
    if any(gain is None or not 1 <= gain <= GAIN_MAX for gain in measured):
        return []
    shapes = [tuple(tuple(row * apart + joint for joint in range(JOINTS)) for row in range(3)) for apart in (6, 8, 16)]
    shapes.append(tuple(tuple(3 * joint + row for joint in range(JOINTS)) for row in range(3)))
    wanted = np.array([measured, [0] * JOINTS, [0] * JOINTS])
    found: list[Columns] = []
    for shape in shapes:
        offsets = np.array(shape)
        for start in range(len(held) - int(offsets.max())):
            if (held[start + offsets] == wanted).all():
                p, i, d = (tuple((start + row).tolist()) for row in offsets)
                found.append((p, i, d))
    return found


COMPLETED = "found at this arm, completed by hand"
"""Name of a map that a person has completed."""


def begun_map_text(found: Findings) -> str:
    """Returns a map with a question mark for each missing address; it can be loaded once all are replaced."""
    lines = ["# Replace each question mark with an address, such as 0xFC40.", "version = 1", f'name = "{COMPLETED}"']
    lines += [f"base = 0x{found.base:04X}", f"size = 0x{found.size:02X}"]
    for name, shipped in default_memory_map().registers.items():
        own = [one for one in found.all if one.register == name]
        split = any(one.high is not None for one in own)
        bits = {True: 16, False: 8}[split] if name == "error" else shipped.bits
        lines += ["", f"[registers.{name}]", f'unit = "{shipped.unit}"', f"bits = {bits}"]
        lines += [f"signed = {str(shipped.signed).lower()}", f'access = "{shipped.access}"']
        lines.append(f"low = {addresses_text([one.low for one in own])}")
        if split:
            lines.append(f"high = {addresses_text([one.high for one in own])}")
        origins = ", ".join('"found"' if one.is_found else '"assumed"' for one in own)
        lines.append(f"provenance = [{origins}]")
    return "\n".join(lines) + "\n"


Verdict = Literal["found", "contradicts", "assumed", "unknown"]
"""found:       the evidence leaves no other byte
contradicts: found, but not where the source documents it
assumed:     a place that agrees with all readings, as others do
unknown:     no place, or several"""


@dataclass(frozen=True)
class Finding:
    """One register of one joint (None: of the machine): its addresses, the verdict, and why."""

    register: str
    joint: int | None
    verdict: Verdict
    low: int | None = None
    high: int | None = None
    evidence: str = ""
    bits: int | None = None

    @property
    def is_found(self) -> bool:
        """Whether its place is known."""
        return self.verdict in ("found", "contradicts")

    def as_data(self) -> dict[str, Any]:
        """Returns plain data for JSON and TOML."""
        data = {name: value for name, value in asdict(self).items() if value is not None and value != ""}
        return data | {name: f"{data[name]:04X}" for name in ("low", "high") if name in data}


@dataclass(frozen=True)
class Findings:
    """All findings, and `joints`, the evidence for them."""

    base: int
    size: int
    all: tuple[Finding, ...]
    joints: tuple[JointEvidence, ...] = field(repr=False, default=())
    free_running: tuple[int, ...] = ()
    """Addresses that change while nothing moves."""
    unchanged: tuple[tuple[int, int], ...] = ()
    """(address, byte) of bytes that changed neither with motion nor with power cycles."""

    def of(self, register: str, joint: int | None = None) -> Finding:
        """Returns the finding on a register."""
        return next(one for one in self.all if (one.register, one.joint) == (register, joint))

    def missing(self) -> list[Finding]:
        """Registers without a place."""
        return [one for one in self.all if one.low is None]

    def without_place(self) -> tuple[str, ...]:
        """Names of the registers without a place on some joint, each once, in the order of the map."""
        return tuple(dict.fromkeys(one.register for one in self.missing()))

    def absent(self) -> tuple[str, ...]:
        """Names of the registers that the memory map leaves out, because they have no place.

        Nothing reads or writes them. Gains are left out together.
        """
        names = {name for name in self.without_place() if name in MAY_BE_ABSENT}
        names |= set(GAIN_REGISTERS) if names & set(GAIN_REGISTERS) else set()
        return tuple(name for name in MAY_BE_ABSENT if name in names)

    def essential(self) -> tuple[str, ...]:
        """Names of the registers without a place that every memory map needs."""
        return tuple(name for name in self.without_place() if name not in MAY_BE_ABSENT)

    def memory_map(self, name: str) -> MemoryMap | None:
        """Returns the memory map, with "found" and "assumed" for each address, without the `absent` registers.

        None while a set point, position, error or power has no place, or if the errors of some joints have two bytes
        and of others one.
        """
        widths = {one.high is None for one in self.all if one.register == "error"}
        if self.essential() or len(widths) > 1:
            return None
        shipped, absent = default_memory_map(), self.absent()
        registers = {
            key: self._register(key, register) for key, register in shipped.registers.items() if key not in absent
        }
        return MemoryMap(version=1, name=name, base=self.base, size=self.size, registers=registers)

    def _register(self, name: str, shipped: Register) -> Register:
        own = [one for one in self.all if one.register == name]
        low = tuple(one.low for one in own if one.low is not None)
        high = tuple(one.high for one in own if one.high is not None)
        change: dict[str, Any] = {"low": low, "high": high if len(high) == len(low) else None}
        change["provenance"] = tuple("found" if one.is_found else "assumed" for one in own)
        if name == "error":
            change["bits"] = 16 if change["high"] else 8
        return shipped.model_copy(update=change)


def judge(recording: Recording) -> Findings:
    """Returns the verdicts on a recording. Pure: the same recording gives the same verdicts."""
    joints = tuple(joint_evidence(recording, joint) for joint in range(1, JOINTS + 1))
    joints = _without_shared_bytes(joints)
    found = [one for joint in joints for one in _of_joint(recording, joint)]
    found += _gains(recording, joints, found)
    found += _signals(recording, found)
    order = list(default_memory_map().registers)
    found.sort(key=lambda one: (order.index(one.register), one.joint or 0))
    rest = [stage for stage in recording.stages if stage.kind == "rest"]
    running = np.flatnonzero(np.max([spread(stage.pages) for stage in rest], axis=0) > 16) if rest else ()
    held = constants(recording.stages)
    return Findings(
        recording.base,
        recording.size,
        tuple(found),
        joints,
        tuple(int(recording.base + offset) for offset in running),
        tuple((int(recording.base + offset), int(held[offset])) for offset in np.flatnonzero(held >= 0)),
    )


def _places(joint: JointEvidence) -> dict[str, Place]:
    found: dict[str, Place] = {}
    if joint.pair is not None:
        found |= {"position": joint.pair.position, "error": joint.pair.error}
    if joint.power is not None:
        found["power"] = joint.power.place
    if joint.set_point is not None and joint.set_point.place is not None:
        found["set_point"] = joint.set_point.place
    return found


def _without_shared_bytes(joints: tuple[JointEvidence, ...]) -> tuple[JointEvidence, ...]:
    """Withdraws places that two joints share: one byte cannot belong to both."""
    users: dict[int, set[int]] = {}
    for joint in joints:
        for place in _places(joint).values():
            for offset in (place.low, place.high):
                if offset is not None:
                    users.setdefault(offset, set()).add(joint.joint)
    shared = {number for numbers in users.values() if len(numbers) > 1 for number in numbers}
    return tuple(
        JointEvidence(joint.joint, None, None, None, "another joint has the same bytes")
        if joint.joint in shared
        else joint
        for joint in joints
    )


def _of_joint(recording: Recording, joint: JointEvidence) -> list[Finding]:
    places, base = _places(joint), recording.base
    why = {"position": joint.lacks, "error": joint.lacks, "power": joint.lacks, "set_point": joint.lacks}
    if joint.pair is not None:
        share = f"{joint.pair.share:.1%} of readings"
        why["position"] = (
            f"12 bits without a jump while moved by hand; with the error it gives one set point in {share}"
        )
        why["error"] = f"set point minus position in {share}, {joint.pair.delay * 1e3:+.1f} ms from it"
        why["set_point"] = _set_point_evidence(joint, base)
    if joint.power is not None:
        why["power"] = (
            f"{joint.power.gain:.2f} times the error up to its limit in {joint.power.share:.1%} of readings, "
            f"with {joint.power.inside} different errors"
        )
    found = []
    for name in ("position", "error", "power", "set_point"):
        place = places.get(name)
        if place is None:
            found.append(Finding(name, joint.joint, "unknown", evidence=why[name]))
            continue
        low, high = base + place.low, None if place.high is None else base + place.high
        verdict = _documented(name, joint.joint, low, high)
        found.append(Finding(name, joint.joint, verdict, low, high, why[name]))
    return found


def _set_point_evidence(joint: JointEvidence, base: int) -> str:
    found = joint.set_point
    if found is None:
        return "error + position is no set point in posture units"
    shown = ", ".join(map(str, found.postures))
    if found.place is not None:
        return f"the only bytes that hold error + position in posture units after each power-up: {shown}"
    if len(set(found.postures)) < LEAST_SET_POINTS:
        return f"only {len(set(found.postures))} different set points were seen ({shown})"
    low, high = (", ".join(f"{base + offset:04X}" for offset in column) or "none" for column in (found.low, found.high))
    return f"for {shown}: low byte {low}, high byte {high}"


def _documented(name: str, joint: int, low: int, high: int | None) -> Verdict:
    """Whether a finding contradicts the source."""
    register = default_memory_map()[name]
    if register.provenance[joint - 1] != "documented" or register.high is None:
        return "found"
    return "found" if (low, high) == (register.low[joint - 1], register.high[joint - 1]) else "contradicts"


def _gains(recording: Recording, joints: tuple[JointEvidence, ...], found: list[Finding]) -> list[Finding]:
    """Finds gains. The controller never changes them, so a reading alone proves none.

    The best evidence is a pattern of bytes that holds the gains that errors and powers show.
    """
    taken = {offset for one in found for offset in (one.low, one.high) if offset is not None}
    free = np.ones(recording.size, bool)
    free[[address - recording.base for address in taken]] = False
    held = np.where(free, constants([s for s in recording.stages if s.kind != "inputs"]), -1)
    measured = [None if joint.power is None else round(joint.power.gain) for joint in joints]
    patterns = gain_columns(held, measured)
    shipped = _shipped_gains(recording)
    several = len(patterns)
    if shipped in patterns:
        patterns = [shipped]
    if len(patterns) != 1:
        why = "no pattern of bytes holds the gains that were measured"
        if patterns:
            why = f"{len(patterns)} patterns of bytes hold the gains that were measured"
        return [Finding(f"gain_{g}", joint, "unknown", evidence=why) for g in "pid" for joint in range(1, JOINTS + 1)]
    which = "the only pattern" if several == 1 else f"where the shipped map assumes them, one of {several} patterns"
    why = f"{which} of bytes that holds P = {', '.join(map(str, measured))} and small I and D; not proved"
    return [
        Finding(f"gain_{g}", joint, "assumed", recording.base + column[joint - 1], None, why)
        for g, column in zip("pid", patterns[0], strict=True)
        for joint in range(1, JOINTS + 1)
    ]


def _shipped_gains(recording: Recording) -> Columns:
    """Returns the addresses of the gains in the shipped map."""
    p, i, d = (tuple(address - recording.base for address in default_memory_map()[f"gain_{g}"].low) for g in "pid")
    return p, i, d


def _signals(recording: Recording, found: list[Finding]) -> list[Finding]:
    """Finds process inputs by switching them. Only the host would change outputs and gripper."""
    result = []
    inputs = [stage for stage in recording.stages if stage.kind == "inputs"]
    at_rest = constants([stage for stage in recording.stages if stage.kind != "inputs"])
    place: int | None = None
    if inputs:
        values = np.array([np.median(stage.pages, axis=0) for stage in inputs])
        pattern = np.array([stage.joint for stage in inputs], float)[:, None]
        following = np.flatnonzero((at_rest >= 0) & (values == pattern).all(axis=0))
        place = int(following[0]) if len(following) == 1 else None
    why = "no input was switched" if not inputs else "the only byte that followed the inputs that were switched"
    if place is not None:
        result.append(Finding("process_inputs", None, "found", recording.base + place, None, why))
    else:
        result.append(
            Finding(
                "process_inputs",
                None,
                "unknown",
                evidence=why if not inputs else "no byte followed them, or several did",
            )
        )
    taken = {address for one in [*found, *result] for address in (one.low, one.high)}
    for name in ("process_outputs", "gripper"):
        address = default_memory_map()[name].low[0]
        why = "only the host changes it, so readings do not show it"
        if address not in taken and at_rest[address - recording.base] == 0:
            why += "; the shipped map's address agrees with all readings"
            result.append(Finding(name, None, "assumed", address, None, why))
        else:
            result.append(Finding(name, None, "unknown", evidence=f"{why}; the shipped map's address is wrong"))
    return result
