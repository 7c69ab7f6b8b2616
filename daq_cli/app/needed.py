"""Which extra each subcommand needs: read before typer is imported, which may be what is missing."""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.extras import Extra

MODEL = frozenset(
    [
        "batch",
        "blind",
        "check",
        "compare",
        "design",
        "diagnose",
        "fit",
        "profile",
        "sensitivity",
        "simulate",
        "thesis",
        "validate",
    ]
)
SERVER = frozenset(["audit", "backup", "notify", "restore", "serve", "token"])
WITH_A_VALUE = frozenset(["--config", "--port", "--robot", "--server"])
"""Options before the subcommand that are followed by their value."""


def called(arguments: Sequence[str]) -> str:
    """The subcommand that is called; empty where there is none."""
    left = iter(arguments)
    for word in left:
        if word in WITH_A_VALUE:
            next(left, None)
        elif not word.startswith("-"):
            return word
    return ""


def extra_of(subcommand: str) -> Extra:
    """The extra that a subcommand needs here. With `--server`, `robot` suffices for those of models."""
    if subcommand in MODEL:
        return "model"
    return "server" if subcommand in SERVER else "robot"
