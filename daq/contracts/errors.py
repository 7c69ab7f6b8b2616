"""Errors shown to users. Each is one line that states what is wrong, where, and what is allowed; if a file has several
mistakes, a line follows for each.

`exit_code` is the exit code of the command line, from `daq.contracts.exit_codes`.
"""

from __future__ import annotations

from typing import ClassVar

from daq.contracts import exit_codes

MISTAKE = "\n  "
"""Precedes each of several mistakes of one file, so that each has a line of its own."""


class DaqError(Exception):
    """Base of every error that is shown to the user; its text is one line."""

    exit_code: ClassVar[int] = exit_codes.PROGRAM_FAULT


class SpecError(DaqError):
    """An experiment, machine or configuration is invalid."""

    exit_code = exit_codes.WRONG_INPUT


class TraceError(DaqError):
    """A trace cannot be read, written or found, or its content is inconsistent."""

    exit_code = exit_codes.WRONG_INPUT


class ReachError(DaqError):
    """A robot, its owner, a port, a folder or a database cannot be reached, or another program uses it."""

    exit_code = exit_codes.NOT_REACHED


class SafetyError(DaqError):
    """An operation was refused because it is not safe now. Nothing moved."""

    exit_code = exit_codes.REFUSED


class OrderFailedError(SafetyError):
    """The process or service that owns the robot did not carry out an order. The exit code is the reported one."""

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.exit_code = exit_code  # type: ignore[misc]
