"""Errors that a user meets: one clear line each, saying what is wrong, where, and what is allowed.

`exit_code` is what the command line ends with (documented in docs/command-line.md): 2 wrong input, 3 robot not
reached, 4 refused for safety, 5 the run ended in a fault.
"""

from __future__ import annotations

from typing import ClassVar


class DaqError(Exception):
    """Base of every error that is the user's to see; its text is one line."""

    exit_code: ClassVar[int] = 1


class SpecError(DaqError):
    """An experiment, machine or configuration that cannot be carried out as written."""

    exit_code = 2


class TraceError(DaqError):
    """A trace that cannot be what it claims to be."""

    exit_code = 2


class ReachError(DaqError):
    """The robot, or the process that owns it, cannot be reached."""

    exit_code = 3


class SafetyError(DaqError):
    """Something was refused because it is not safe now. Nothing moved."""

    exit_code = 4
