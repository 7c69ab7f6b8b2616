"""Errors that a user meets: one clear line each, saying what is wrong, where, and what is allowed.

`exit_code` is the exit code of the command line, one of `daq.contracts.exit_codes`.
"""

from __future__ import annotations

from typing import ClassVar

from daq.contracts import exit_codes


class DaqError(Exception):
    """Base of every error that is shown to the user; its text is one line."""

    exit_code: ClassVar[int] = exit_codes.PROGRAM_FAULT


class SpecError(DaqError):
    """An experiment, machine or configuration that cannot be carried out as written."""

    exit_code = exit_codes.WRONG_INPUT


class TraceError(DaqError):
    """A trace that cannot be read, written or found, or whose content contradicts itself."""

    exit_code = exit_codes.WRONG_INPUT


class ReachError(DaqError):
    """The robot, or the process that owns it, cannot be reached."""

    exit_code = exit_codes.NOT_REACHED


class SafetyError(DaqError):
    """Something was refused because it is not safe now. Nothing moved."""

    exit_code = exit_codes.REFUSED


class OrderFailedError(SafetyError):
    """The process or the service that has the robot did not carry out an order; it has the exit code reported."""

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.exit_code = exit_code  # type: ignore[misc]
