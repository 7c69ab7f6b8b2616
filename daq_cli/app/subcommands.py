"""The subcommands of the core and of plug-ins. Read before typer is imported, which may be missing."""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.extras import Extra
from daq.plugins import Command, plugins

CORE = {
    command.name: command
    for command in (
        Command("run", "Run an experiment and record its trace.", "daq_cli.commands.run", group="Run"),
        Command("stop", "Stop every moving robot, at once.", "daq_cli.commands.stop", group="Run"),
        Command("reset", "End the freeze of a stop; nothing moves.", "daq_cli.commands.reset", group="Run"),
        Command("status", "Show posture, state and link of the robot.", "daq_cli.commands.status", group="Run"),
        Command("ports", "List serial ports that may lead to a robot.", "daq_cli.commands.ports", about="computer"),
        Command("gains", "Show or set the controller's PID gains.", "daq_cli.commands.gains", group="Run"),
        Command("io", "Show and switch process signals, and the gripper.", "daq_cli.commands.process_io", group="Run"),
        Command(
            "teach", "Jog the arm, lead it, make steps, and play back.", "daq_cli.commands.teach.motion", group="Run"
        ),
        Command(
            "robot",
            "Check what a controller promises; nothing moves.",
            "daq_cli.commands.robot_check",
            about="computer",
        ),
        Command("calibrate", "Measure what the machine really does.", "daq_cli.commands.calibrate"),
        Command(
            "serve",
            "Serve experiments and traces to people and programs.",
            "daq_cli.commands.serve",
            about="service",
            needs="server",
            group="Service",
        ),
        Command(
            "queue", "Show, pause and resume the queue of a server's robot.", "daq_cli.commands.queue", group="Service"
        ),
        Command(
            "token",
            "Make, list and revoke tokens of the service.",
            "daq_cli.commands.token",
            about="service",
            needs="server",
            group="Service",
        ),
        Command("traces", "List, show, plot, convert and verify traces.", "daq_cli.commands.traces", group="Look"),
        Command("config", "Show and check the configuration.", "daq_cli.commands.config", about="computer"),
        Command(
            "mock", "Start a mock controller that others can connect to.", "daq_cli.commands.mock", about="computer"
        ),
        Command(
            "check",
            "Check records before anything is computed from them.",
            "daq_cli.commands.check",
            about="computer",
            needs="model",
            group="Look",
        ),
        Command("fit", "Fit a model's parameters to traces.", "daq_cli.commands.fit", needs="model", group="Model"),
        Command(
            "profile",
            "Show what traces bound: profile likelihoods of parameters.",
            "daq_cli.commands.profile",
            about="computer",
            needs="model",
            group="Model",
        ),
        Command(
            "validate",
            "Validate a model against traces (Σλ²).",
            "daq_cli.commands.validate",
            needs="model",
            group="Model",
        ),
        Command(
            "simulate",
            "Simulate recorded traces with a model.",
            "daq_cli.commands.simulate",
            about="computer",
            needs="model",
            group="Model",
        ),
        Command(
            "compare", "Compare models on the same traces.", "daq_cli.commands.compare", needs="model", group="Look"
        ),
        Command(
            "diagnose",
            "Name the effect that a model lacks, and show the gap shrink.",
            "daq_cli.commands.diagnose",
            needs="model",
            group="Model",
        ),
        Command(
            "design",
            "Propose experiments that determine parameters best.",
            "daq_cli.commands.design",
            about="computer",
            needs="model",
            group="Model",
        ),
        Command("docs", "Open the documents in the browser.", "daq_cli.commands.docs", about="computer"),
        Command(
            "demo",
            "Run the ramp step on the mock, from command to plot.",
            "daq_cli.commands.demo",
            about="computer",
            group="Run",
        ),
    )
}
"""Subcommands of the core by name, in the order of the help."""
WITH_A_VALUE = frozenset(["--config", "--port", "--robot", "--server"])
"""Options before the subcommand that have a value."""


def subcommands() -> dict[str, Command]:
    """Returns all subcommands by name; a plug-in cannot replace one of the core."""
    return {**CORE, **{name: command for name, command in _added().items() if name not in CORE}}


def subcommand(name: str) -> Command | None:
    """Returns the subcommand of a name. Plug-ins are searched only if the core has none."""
    return CORE.get(name) or _added().get(name)


def _added() -> dict[str, Command]:
    return {command.name: command for plugin in plugins() for command in plugin.commands}


def called(arguments: Sequence[str]) -> str:
    """Returns the name of the called subcommand; empty if there is none."""
    left = iter(arguments)
    for word in left:
        if word in WITH_A_VALUE:
            next(left, None)
        elif not word.startswith("-"):
            return word
    return ""


def extra_of(name: str) -> Extra:
    """Returns the extra that a subcommand needs here. With `--server`, `robot` suffices for model commands."""
    found = subcommand(name)
    return "robot" if found is None else found.needs
