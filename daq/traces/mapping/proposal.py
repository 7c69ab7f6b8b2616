"""Proposes the meaning of a table's columns: by a known format, or else a guess from their names, to be confirmed."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from daq.contracts.errors import TraceError
from daq.traces.mapping.expression import Table, tokens_in
from daq.traces.mapping.signals import BY_JOINT, SIGNALS, Said, said
from daq.traces.mapping.units import known_units, unit_in

KNOWN: tuple[dict[str, str], ...] = (
    {
        "format": "a table of this program",
        "time": "time in s",
        "position": "position_{} in rad",
        "set_point": "set_point_{} in rad",
        "velocity": "velocity_{} in rad/s",
        "drive": "drive_{} in ?",
    },
    {
        "format": "a data set of lerobot",
        "time": "timestamp in s",
        "position": "observation.state[{}.pos] in ?",
        "set_point": "action[{}.pos] in ?",
    },
    {
        "format": "a data set of lerobot",
        "time": "timestamp in s",
        "position": "observation.state[{}] in ?",
        "set_point": "action[{}] in ?",
        "velocity": "observation.velocity[{}] in ?",
        "drive": "observation.effort[{}] in ?",
    },
    {  # https://docs.universal-robots.com/tutorials/communication-protocol-tutorials/rtde-guide.html
        "format": "a record of UR's RTDE",
        "time": "timestamp in s",
        "position": "actual_q_{} in rad",
        "set_point": "target_q_{} in rad",
        "velocity": "actual_qd_{} in rad/s",
        "drive": "actual_current_{} in A",
    },
    {  # libfranka, logToCSV
        "format": "a log of libfranka",
        "time": "time in ms",
        "position": "state.q[{}] in rad",
        "set_point": "state.q_d[{}] in rad",
        "velocity": "state.dq[{}] in rad/s",
        "drive": "state.tau_J[{}] in Nm",
    },
    {  # https://github.com/mjbots/moteus/blob/main/docs/reference/diagnostic.md
        "format": "telemetry of a moteus",
        "time": "timestamp in s",
        "position": "servo_stats.position in rev",
        "velocity": "servo_stats.velocity in rev/s",
        "drive": "servo_stats.torque_Nm in Nm",
    },
    {  # https://docs.odriverobotics.com, axis.pos_estimate and controller.input_pos
        "format": "a record of an ODrive",
        "time": "time in s",
        "position": "pos_estimate in turns",
        "set_point": "input_pos in turns",
        "velocity": "vel_estimate in turns/s",
        "drive": "Iq_measured in A",
    },
)
"""Known formats by their columns; `?` is a unit that the files do not state."""

WORDS: dict[str, tuple[str, ...]] = {
    "time": ("time", "timestamp", "t", "stamp", "seconds", "sec", "elapsed", "log_time"),
    "position": ("position", "pos", "q", "theta", "angle", "present_position", "qpos", "q_present", "joint_position"),
    "set_point": ("set_point", "setpoint", "goal_position", "target_position", "target", "command", "q_d", "goal"),
    "velocity": ("velocity", "vel", "speed", "dq", "qd", "qvel", "omega", "present_velocity", "rpm", "joint_velocity"),
    "drive": (
        "torque",
        "tau",
        "effort",
        "current",
        "voltage",
        "present_current",
        "present_load",
        "joint_torque",
        "iq",
        "force",
    ),
}
"""Usual column names of a signal, alone or with a joint's name or number."""
LEAST_LETTERS = 4
"""Letters of an abbreviation of such a word, as in `velo`."""
_FORMS = ("@[{}]", "@.{}", "@_{}", "{}.@", "{}_@", "{} @")
"""Position of a joint's name relative to such a word, @."""
_STEPS = ((1e4, "ns"), (1e2, "µs"), (0.8, "ms"), (0.0, "s"))
"""Time between rows from which a time is probably in this unit: arms are sampled at 1 Hz to 10 kHz."""


@dataclass(frozen=True)
class Proposal:
    """A proposed meaning of a table's columns. sure: whether the format is known; units given as `?` are open even
    then."""

    format: str
    entries: dict[str, Said]
    sure: bool


def proposal(table: Table) -> Proposal:
    """Returns the known format of a table, or else a guess, with all signals that were found."""
    for known in KNOWN:
        if all(_is_there(table, known[key].partition(" in ")[0]) for key in ("time", "position")):
            texts = {key: text for key, text in known.items() if key != "format"}
            there = {key: text for key, text in texts.items() if _is_there(table, text.partition(" in ")[0])}
            return Proposal(known["format"], {key: _open(key, text, table) for key, text in there.items()}, True)
    found = {signal: name for signal in SIGNALS if (name := _guess(table, signal)) is not None}
    entries = {signal: Said(name, _guessed_unit(table, signal, name)) for signal, name in found.items()}
    return Proposal("", entries, False)


def settled(table: Table, given: Mapping[str, str], *, as_guessed: bool) -> tuple[dict[str, Said], dict[str, Said]]:
    """Returns the entries to import: the given ones and, for other signals, those of the known format or the accepted
    guess. Also returns entries that are left out because columns were given for other signals.

    Raises TraceError with everything found and guessed, and the options that settle it.
    """
    entries = {key: said(key, text, table.origin) for key, text in given.items()}
    guess = proposal(table)
    for key, entry in guess.entries.items():
        own = {name for name in entries if name == key or name.startswith(f"{key}_")}
        if own == {key} and not entries[key].expression:
            entries[key] = Said(entry.expression, entries[key].unit)
        elif not own:
            entries[key] = entry
    for key, entry in entries.items():
        if not entry.expression and entry.unit != "none":
            raise TraceError(f"{table.origin}: no column looks like {key}; the file has {table.listed()}")
    like = entries.get("position")
    if "set_point" in entries and entries["set_point"].unit == "?" and like is not None and like.unit != "?":
        entries["set_point"] = Said(entries["set_point"].expression, like.unit)
    left_out: dict[str, Said] = {}
    chosen = any(said(key, text, table.origin).expression for key, text in given.items() if key != "time")
    if chosen and not guess.sure and not as_guessed:
        left_out = {key: entries.pop(key) for key in [*entries] if key not in given and key != "time"}
    guessed = [key for key in entries if key not in given]
    open_units = [key for key, entry in entries.items() if entry.unit == "?"]
    if open_units or (guessed and not guess.sure and not as_guessed) or not _enough(entries):
        raise TraceError(_question(table, guess, entries, open_units, guessed))
    return entries, left_out


def _enough(entries: Mapping[str, Said]) -> bool:
    signals = {key.rpartition("_")[0] if key[-1].isdigit() else key for key in entries}
    return "time" in signals and bool({"position", "velocity"} & signals)


def _question(table: Table, guess: Proposal, entries: Mapping[str, Said], units: list[str], guessed: list[str]) -> str:
    """Returns one line: what was found, what is guessed, what is open, and the options that settle it."""
    what = f"is {guess.format}" if guess.sure else "its columns have other names than this program's"
    lacking = [key for key in ("time", "position") if not _enough(entries) and key not in entries]
    options = [f"--map '{key}={entry}'" for key, entry in entries.items() if key in guessed or key in units]
    options += [f"--map '{key}=COLUMN{'{}' if key in BY_JOINT else ''}'" for key in lacking]
    asked = [f"{key} ({', '.join(known_units(key)[:6])}{_range(key, guess)})" for key in units]
    said_of = f"; not stated: the unit of {' and of '.join(asked)}" if asked else ""
    looked_for = ["position or velocity" if key == "position" else key for key in lacking]
    missing = f"; nothing looks like {' or '.join(looked_for)}" if lacking else ""
    rest = "" if units or lacking else "; --as-guessed accepts this guess"
    return (
        f"{table.origin}: {what}: {table.listed()}{missing}{said_of}. "
        f"Say {' '.join(options)}{rest}; `--map drive=none` leaves a signal out"
    )


def _range(key: str, guess: Proposal) -> str:
    if key.startswith("drive"):
        return "; for a share: ‰ of 7.4 V"
    return (
        "; for -100 to 100: range of CALIBRATION.json, range of MACHINE"
        if "lerobot" in guess.format and key in ("position", "set_point")
        else ""
    )


def _open(key: str, text: str, table: Table) -> Said:
    expression, _, unit = text.partition(" in ")
    return Said(expression, "?") if unit == "?" else said(key, text, table.origin)


def _is_there(table: Table, name: str) -> bool:
    if "{}" not in name:
        return name in table.columns
    tokens = tokens_in(name, table.columns)  # brackets may hold a joint's name; elsewhere joints have numbers
    return any("[{" in name or token.isdecimal() for token in tokens)


def _guess(table: Table, signal: str) -> str | None:
    """Returns the first column or pattern with a usual name of the signal, whatever unit follows it."""
    bare = {_bare(signal, name): name for name in reversed(table.columns)}
    for word in WORDS[signal]:
        for name in (word, f"{word}s", *(one for one in bare if len(one) >= LEAST_LETTERS and word.startswith(one))):
            if name in bare:
                return bare[name]
        if signal == "time":
            continue
        patterns: dict[str, int] = {}
        for name in table.columns:
            pattern = re.sub(r"\d+", "{}", name)
            words = re.findall(r"[^\W\d_]+", _bare(signal, pattern))
            if pattern.count("{}") == 1 and {word, f"{word}s"} & {*words[:1], *words[-1:], "_".join(words)}:
                patterns[pattern] = len(tokens_in(pattern, table.columns))
        for pattern in [form.replace("@", word) for form in _FORMS]:
            tokens = tokens_in(pattern, list(bare))
            if len(tokens) > 1:
                name = bare[pattern.replace("{}", tokens[0])]
                at = name.lower().find(tokens[0])
                patterns.setdefault(f"{name[:at]}{{}}{name[at + len(tokens[0]) :]}", len(tokens))
        if patterns:
            return max(patterns, key=lambda pattern: patterns[pattern])  # the one that leaves no joint out
    return None


def _bare(signal: str, name: str) -> str:
    """Returns a column's name in lower case, without the unit at its end and without its group."""
    unit = unit_in(signal, name)
    text = name.strip().lower()
    text = text if unit is None or unit == text else text[: text.rfind(unit.lower()[:3])].rstrip(" _([")
    return text.rpartition(".")[2]


def _guessed_unit(table: Table, signal: str, name: str) -> str:
    """Returns the unit in a name. For a time, it is the unit that makes the time between rows that of an arm."""
    unit = unit_in(signal, name)
    if unit is not None or signal != "time":
        return unit or "?"
    steps = np.diff(table.columns[name])
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    return next(unit for least, unit in _STEPS if usual >= least)
