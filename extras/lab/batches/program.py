"""Identifies the version of this program that computes a job: one table must not mix versions."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from typing import Any

from daq.executors.workers import OtherVersionError

PACKAGE = "ma2000-daq"


@dataclass(frozen=True)
class Program:
    """A version of this program, and the version of Python (3.11) that runs it."""

    package: str
    python: str

    def __str__(self) -> str:
        return f"{PACKAGE} {self.package} on Python {self.python}"


@cache
def program_here() -> Program:
    """Returns the versions of this process."""
    return Program(version(PACKAGE), ".".join(map(str, sys.version_info[:2])))


def refuse_other(worker: str, has: Program, needed: Program) -> None:
    """Raises OtherVersionError, which names the worker, if versions differ."""
    if has != needed:
        raise OtherVersionError(f"worker {worker}: has {has}, but {needed} is needed; install that there")


@dataclass(frozen=True)
class Checked:
    """A function that a worker calls only if its versions are those of the caller."""

    function: Callable[..., Any]
    program: Program

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Raises OtherVersionError."""
        refuse_other(f"{platform.node()}, process {os.getpid()}", program_here(), self.program)
        return self.function(*args, **named)
