"""The steps of a commissioning, in order: what each does, what to watch, how to stop, and which steps must precede
it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any, NamedTuple

from daq.contracts.errors import SpecError
from extras.commissioning.command.bench import Bench
from extras.commissioning.command.by_command import first_ramp, gain, model, period, ramp, stop
from extras.commissioning.command.by_hand import emergency_stop, end_stops, potentiometers
from extras.commissioning.command.delay import delay
from extras.commissioning.command.line_and_memory import bridge, line, memory
from extras.commissioning.command.record import Record

NOT_TO_BE_SKIPPED = ("bridge", "period", "ramp")
"""Steps on whose results later steps rely."""
RESTS_ON = {
    "bridge": ("port", "memory_map"),
    "potentiometers": ("memory_map",),
    "end_stops": ("memory_map",),
    "emergency_stop": ("port", "memory_map"),
    "delay": ("port",),
    "gain": ("machine",),
    "first_ramp": ("machine",),
    "ramp": ("machine",),
    "model": ("machine",),
}
"""Direct basis of a step's result; it also depends on the steps that it needs."""


class Step(NamedTuple):
    """One step: what it does, what to watch, how to stop, and the function that returns its result."""

    name: str
    title: str
    does: str
    watch: str
    stop: str
    run: Callable[[Bench], dict[str, Any]]
    needs: tuple[str, ...] = ()
    """Steps that must be done, or safely left out on purpose, before this one."""
    at_the_arm: bool = True
    """Whether a person at the arm must confirm that it may begin, even with --yes."""
    at_the_port: bool = True
    """Whether it communicates with the controller."""


SEE = "It only reads; nothing moves."
KEY = "Ctrl-C, `daq stop` in another terminal, or the emergency stop"
BEFORE_MOVING = ("bridge", "potentiometers", "end_stops", "emergency_stop", "stop")
STEPS = (
    Step("line", "Port and line", "Reads one byte 200 times.", SEE, "Ctrl-C", line, at_the_arm=False),
    Step(
        "memory",
        "Memory map",
        "Finds the registers while you move the arm by hand; at the end moves each joint by a degree and back.",
        "The arm, which may sink while the emergency stop is pressed.",
        "the emergency stop; q or Ctrl-C ends the search",
        memory,
    ),
    Step(
        "bridge",
        "The bridge's memory map",
        "Compares the bridge's readings with the map that was found.",
        SEE,
        "Ctrl-C",
        bridge,
        ("memory",),
        at_the_arm=False,
    ),
    Step(
        "potentiometers",
        "Potentiometers",
        "Reads each joint at five postures or more, whose angles you measure with a protractor.",
        "The arm, which may sink while the emergency stop is pressed.",
        "the emergency stop stays pressed throughout",
        potentiometers,
        ("memory",),
    ),
    Step(
        "end_stops",
        "End stops",
        "Reads each joint at its end stops, to which you lead it by hand; the limits then keep two degrees from them.",
        "The arm, which may sink while the emergency stop is pressed.",
        "the emergency stop stays pressed throughout",
        end_stops,
        ("potentiometers",),
    ),
    Step(
        "emergency_stop",
        "Emergency stop",
        "Reads whether a joint that you push off its set point stays there while the emergency stop is pressed.",
        "The arm, which may sink while the emergency stop is pressed.",
        "the emergency stop stays pressed",
        emergency_stop,
        ("memory",),
    ),
    Step(
        "stop",
        "The program's stop",
        "Stops the resting arm and releases it again.",
        "The arm stays where it is.",
        "the emergency stop",
        stop,
        ("bridge",),
    ),
    Step(
        "period", "Control period", "Follows 150 control periods.", SEE, "Ctrl-C", period, ("bridge",), at_the_arm=False
    ),
    Step(
        "delay",
        "Computing delay",
        "Moves joint 1 to and fro by half a degree, 36 times, and writes the computing delay into the machine file.",
        "The arm.",
        KEY,
        delay,
        (*BEFORE_MOVING, "period"),
    ),
    Step(
        "gain",
        "Gain of each joint",
        "Moves the joints by steps of 1 to 3 degrees at three postures, and writes the gain into the machine file.",
        "The arm.",
        KEY,
        gain,
        BEFORE_MOVING,
    ),
    Step(
        "first_ramp",
        "First ramp, joint 1",
        "Moves joint 1 by 21.6 degrees in 0.65 s.",
        "The arm.",
        KEY,
        first_ramp,
        BEFORE_MOVING,
    ),
    Step(
        "ramp",
        "Ramp, joints 1 to 3",
        "Moves joints 1 to 3 by 21.6 degrees in 0.65 s.",
        "The arm.",
        KEY,
        ramp,
        (*BEFORE_MOVING, "first_ramp"),
    ),
    Step(
        "model",
        "The model",
        "Compares the ramp with the machine file; if they differ, a diagnosis suggests what may be missing.",
        "It only computes.",
        "Ctrl-C",
        model,
        ("ramp",),
        at_the_arm=False,
        at_the_port=False,
    ),
)
"""All steps, in order."""


def lacking(step: Step, record: Record) -> list[str]:
    """Returns the steps that must be done before this one. Some may be left out with --skip."""
    return [
        name
        for name in step.needs
        if name not in record.steps or (name in NOT_TO_BE_SKIPPED and record.steps[name].get("skipped"))
    ]


def resting_on(names: Collection[str]) -> set[str]:
    """Returns the steps whose results depend on these steps, directly or not."""
    found: set[str] = set()
    for step in STEPS:  # in order, so that one pass is enough
        if {*names, *found} & set(step.needs):
            found.add(step.name)
    return found


def stale(bench: Bench) -> set[str]:
    """Returns steps whose results are from another port, memory map or machine file, and those that depend on them."""
    now = bench.basis()
    changed = {
        name
        for name, of in RESTS_ON.items()
        if name in bench.record.steps and not bench.record.steps[name].get("skipped")
        if any(bench.record.steps[name].get("basis", {}).get(what) != now[what] for what in of)
    }
    return changed | {name for name in resting_on(changed) if not bench.record.steps.get(name, {}).get("skipped")}


def step_named(name: str) -> Step:
    """Returns a step by its name. Raises SpecError."""
    for one in STEPS:
        if one.name == name:
            return one
    raise SpecError(f"step {name!r}: there are {', '.join(one.name for one in STEPS)}")
