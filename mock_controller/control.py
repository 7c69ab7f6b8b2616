"""Commands of the control port, by which a test, a benchmark or a person controls the mock unseen by the host.

One JSON object per line in, one per line out: `{"do": "counts"}` → `{"ok": true, …}`. An error is answered by `{"ok":
false, "error": "…"}` and changes nothing.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from typing import Any, Protocol

from mock_controller.board.board import BoardError
from mock_controller.device import Device
from mock_controller.faults.fault import FaultError
from mock_controller.faults.registry import describe

Answer = dict[str, Any]
_LONGEST_LEAD_S = 600.0
_JOINTS = tuple("123456")
_ENDS = ("low", "high")


class ControlError(ValueError):
    """An invalid command."""


class Process(Protocol):
    """Methods of the process and its line for the control port."""

    def disconnect(self, seconds: float | None) -> None:
        """Cuts the line; restores it after `seconds` of the host's clock, or only by `reconnect`."""
        ...

    def reconnect(self) -> None:
        """Restores the line now."""
        ...

    def kill(self) -> None:
        """Ends the process at once, without an answer."""
        ...

    def clock(self) -> Answer:
        """Returns the relation of board time and the host's clock."""
        ...

    def lost_bytes(self) -> int:
        """Bytes that the host never read."""
        ...


class Control:
    """Carries out commands on one device."""

    def __init__(self, device: Device, process: Process) -> None:
        self._device = device
        self._process = process
        self._commands: dict[str, Callable[[Answer], Answer]] = {
            "help": self._help,
            "state": self._state,
            "counts": self._counts,
            "snapshots": self._snapshots,
            "fault_on": self._fault_on,
            "fault_off": self._fault_off,
            "fault_list": self._fault_list,
            "modifications": self._modifications,
            "brown_out": self._brown_out,
            "inputs": self._inputs,
            "emergency_stop": self._emergency_stop,
            "hand": self._hand,
            "written": self._written,
            "disconnect": self._disconnect,
            "reconnect": self._reconnect,
            "kill": self._kill,
        }

    def execute(self, line: bytes) -> bytes:
        """Returns the answer to one line, newline included."""
        try:
            request = json.loads(line)
            answer = {"ok": True, **self._command(request)(request)}
        except (ControlError, FaultError, BoardError) as error:
            answer = {"ok": False, "error": str(error)}
        except (ValueError, RecursionError):
            answer = {"ok": False, "error": "not a line of JSON"}
        return json.dumps(answer).encode() + b"\n"

    def _command(self, request: object) -> Callable[[Answer], Answer]:
        name = request.get("do") if isinstance(request, dict) else None
        if not isinstance(name, str) or name not in self._commands:
            raise ControlError(f'write {{"do": COMMAND}} with one of {", ".join(self._commands)}')
        return self._commands[name]

    # --- commands

    def _help(self, _: Answer) -> Answer:
        """Lists the commands."""
        return {"commands": {name: (command.__doc__ or "").strip() for name, command in self._commands.items()}}

    def _state(self, _: Answer) -> Answer:
        """Returns board, set points, gains, the latest stop, the arm, the clock."""
        board = self._device.board
        memory = board.memory
        columns = [memory.values(name) for name in ("gain_p", "gain_i", "gain_d")]
        return {
            "time_us": board.time_us,
            "tick": board.tick,
            "powered": board.powered,
            "boots": board.counters.boots,
            "frozen": board.frozen,
            "stop": dataclasses.asdict(self._device.bridge.stops),
            "set_points": memory.values("set_point"),
            "gains": [list(gains) for gains in zip(*columns, strict=True)],
            "missed": board.counters.set_points_missed,
            "angles_rad": None if self._device.keeps_secret else board.plant.joint_angles,
            "motor_volts": None if self._device.keeps_secret else list(board.plant.motor_volts),
            "stalled_joints": sorted(board.plant.stalled_joints),
            "process_outputs": board.process_outputs,
            "gripper_closed": board.gripper_closed,
            "clock": self._process.clock(),
        }

    def _counts(self, _: Answer) -> Answer:
        """Returns injected faults by name and direction, and the counts of bridge and board."""
        bridge, link = self._device.bridge, self._device.link
        return {
            "faults": self._device.faults.counts(),
            "bridge": {
                **dataclasses.asdict(link.counts),
                "answered": dict(bridge.answered),
                "refused": dict(bridge.refused),
                "lost_bytes": self._process.lost_bytes(),
            },
            "board": dataclasses.asdict(self._device.board.counters),
        }

    def _snapshots(self, request: Answer) -> Answer:
        """Returns periods after tick "after" (0) that the ring still keeps, as the board recorded them."""
        after = request.get("after", 0)
        if isinstance(after, bool) or not isinstance(after, int):
            raise ControlError('"after": the number of a tick is needed')
        return {"snapshots": [dataclasses.asdict(kept) for kept in self._device.board.snapshots.after(after)]}

    def _fault_on(self, request: Answer) -> Answer:
        """Switches a fault on: "fault": "NAME:PARAMETER=VALUE,…"."""
        entry = self._device.faults.switch_on(_word(request, "fault"))
        return {"label": entry.label, **describe(entry.fault)}

    def _fault_off(self, request: Answer) -> Answer:
        """Switches off: "fault": a label, or a name for all faults of that name."""
        return {"ended": self._device.faults.switch_off(_word(request, "fault"))}

    def _fault_list(self, _: Answer) -> Answer:
        """Returns the active faults."""
        return {"faults": self._device.faults.listing()}

    def _modifications(self, _: Answer) -> Answer:
        """Returns hidden physical effects with which this mock was started; those of a secret arm are not listed."""
        return {"modifications": list(self._device.modifications)}

    def _brown_out(self, _: Answer) -> Answer:
        """Interrupts the board's supply for a moment."""
        return self._fault_on({"fault": "brown_out"})

    def _inputs(self, request: Answer) -> Answer:
        """Sets the process inputs: "bits": 0 to 255."""
        bits = request.get("bits")
        if isinstance(bits, bool) or not isinstance(bits, int):
            raise ControlError('"bits": a whole number from 0 to 255 is needed')
        self._device.board.set_process_inputs(bits)
        return {"bits": bits}

    def _emergency_stop(self, request: Answer) -> Answer:
        """Presses the emergency stop ("pressed": true) or releases it. The drives lose their power, and a hand holds
        the arm at the answer's "degrees"."""
        pressed = request.get("pressed")
        if not isinstance(pressed, bool):
            raise ControlError('"pressed": true or false is needed')
        board = self._device.board
        board.press_emergency_stop(pressed)
        held = enumerate(board.plant.joint_angles, start=1)
        return {"pressed": pressed, "degrees": {joint: math.degrees(angle) for joint, angle in held}}

    def _hand(self, request: Answer) -> Answer:
        """Moves joints by hand while the emergency stop is pressed: "to": {joint: angle in degrees, or "low" or "high"
        for an end stop}, "seconds"."""
        to, seconds = request.get("to"), request.get("seconds", 0.0)
        if not isinstance(to, dict) or not all(key in _JOINTS and _is_place(value) for key, value in to.items()):
            raise ControlError('"to": degrees by joint are needed, as in {"1": 90}, or "low" or "high" for an end stop')
        if not _is_number(seconds) or not 0 <= seconds <= _LONGEST_LEAD_S:
            raise ControlError(f'"seconds": a number from 0 to {_LONGEST_LEAD_S:g} is needed')
        board = self._device.board
        angles = {
            int(joint): board.end_stop(int(joint), high=place == "high") if place in _ENDS else math.radians(place)
            for joint, place in to.items()
        }
        board.lead(angles, seconds)
        return {"to": {str(joint): math.degrees(angle) for joint, angle in angles.items()}, "seconds": seconds}

    def _written(self, _: Answer) -> Answer:
        """Returns how often the host has written to each address."""
        return {"written": {f"{address:04X}": count for address, count in sorted(self._device.board.written.items())}}

    def _disconnect(self, request: Answer) -> Answer:
        """Cuts the line: "seconds" of the clock until it is restored (without: until reconnect)."""
        seconds = request.get("seconds")
        if seconds is not None and not (_is_number(seconds) and seconds >= 0):
            raise ControlError('"seconds": a number from 0 on, or nothing, is needed')
        self._process.disconnect(seconds)
        return {"seconds": seconds}

    def _reconnect(self, _: Answer) -> Answer:
        """Restores the line now."""
        self._process.reconnect()
        return {}

    def _kill(self, _: Answer) -> Answer:
        """Ends the process at once, without an answer."""
        self._process.kill()
        return {}


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_place(value: object) -> bool:
    return value in _ENDS or _is_number(value)


def _word(request: Answer, key: str) -> str:
    value = request.get(key)
    if not isinstance(value, str):
        raise ControlError(f'"{key}": a word is needed')
    return value
