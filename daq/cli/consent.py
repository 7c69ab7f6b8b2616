"""The operator's word before a real arm moves: asked for where a person can be asked."""

from __future__ import annotations

import sys

import typer

from daq.cli.context import console


def can_be_asked() -> bool:
    """Consent is a person's: what comes through a pipe is nobody's word."""
    return console().is_terminal and sys.stdin.isatty()


def agreed(url: str) -> bool:
    """Whether a person at this terminal says that the arm may move; no when nobody can be asked."""
    return can_be_asked() and typer.confirm(f"{url} is a real arm and will move. Is its workspace clear?", err=True)
