"""Subcommands that are imported when they are used, so that `daq --help` starts fast."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import typer.core
import typer.main

SUBCOMMANDS: dict[str, tuple[str, str]] = {
    "run": ("daq_cli.commands.run", "Run an experiment and record its trace."),
    "stop": ("daq_cli.commands.stop", "Stop every moving robot, at once."),
    "reset": ("daq_cli.commands.reset", "End the freeze of a stop; nothing moves."),
    "status": ("daq_cli.commands.status", "Show posture, state and link of the robot."),
    "ports": ("daq_cli.commands.ports", "List serial ports that may lead to a robot."),
    "gains": ("daq_cli.commands.gains", "Show or set the controller's PID gains."),
    "io": ("daq_cli.commands.process_io", "Show and switch process signals, and the gripper."),
    "teach": ("daq_cli.commands.teach.motion", "Jog the arm, lead it, make steps, and play back."),
    "commission": (
        "daq_cli.commands.commission.command",
        "Commission an arm, step by step, up to its acceptance sheet.",
    ),
    "robot": ("daq_cli.commands.robot_check", "Check what a controller promises; nothing moves."),
    "memory": ("daq_cli.commands.memory", "Watch the shared memory, and find out what lies where."),
    "calibrate": ("daq_cli.commands.calibrate", "Measure what the machine really does."),
    "serve": ("daq_cli.commands.serve", "Serve experiments and traces to people and programs."),
    "queue": ("daq_cli.commands.queue", "Show, pause and resume the queue of a server's robot."),
    "token": ("daq_cli.commands.token", "Make, list and revoke tokens of the service."),
    "audit": ("daq_cli.commands.audit", "Show who asked the service for what; check the log of it."),
    "notify": ("daq_cli.commands.notify", "Try the notifications of the configuration."),
    "backup": ("daq_cli.commands.backup", "Save everything that a service keeps in one file."),
    "restore": ("daq_cli.commands.restore", "Restore a backup."),
    "traces": ("daq_cli.commands.traces", "List, show, plot, convert and verify traces."),
    "config": ("daq_cli.commands.config", "Show and check the configuration."),
    "machine": ("daq_cli.commands.machine", "Turn URDF into machine files, and models into URDF and MJCF."),
    "mock": ("daq_cli.commands.mock", "Start a mock controller that others can connect to."),
    "check": ("daq_cli.commands.check", "Check records before anything is computed from them."),
    "fit": ("daq_cli.commands.fit", "Fit a model's parameters to traces."),
    "profile": ("daq_cli.commands.profile", "Show what traces bound: profile likelihoods of parameters."),
    "validate": ("daq_cli.commands.validate", "Validate a model against traces (Σλ²)."),
    "sensitivity": ("daq_cli.commands.sensitivity", "Show which parameter moves which joint, and when."),
    "simulate": ("daq_cli.commands.simulate", "Simulate recorded traces with a model."),
    "compare": ("daq_cli.commands.compare", "Compare models on the same traces."),
    "diagnose": ("daq_cli.commands.diagnose", "Name the effect that a model lacks, add it, show the gap shrink."),
    "batch": ("daq_cli.commands.batch", "Fit, validate, simulate or diagnose many traces, on many cores."),
    "design": ("daq_cli.commands.design", "Propose experiments that determine parameters best."),
    "thesis": ("daq_cli.commands.thesis", "Reproduce the 1991 source beside its published results."),
    "blind": ("daq_cli.commands.blind", "Hide effects in the mock, diagnose blindly, and score."),
    "docs": ("daq_cli.commands.docs", "Open the documents in the browser."),
    "demo": ("daq_cli.commands.demo", "Run the ramp step on the mock, from command to plot."),
}

HERE = frozenset(
    [
        "ports",
        "serve",
        "token",
        "audit",
        "notify",
        "backup",
        "restore",
        "config",
        "commission",
        "memory",
        "robot",
        "machine",
        "mock",
        "check",
        "simulate",
        "sensitivity",
        "profile",
        "design",
        "thesis",
        "blind",
        "docs",
        "demo",
    ]
)
"""Subcommands about this computer alone: `--server` is refused, and DAQ_SERVER is ignored."""

ALL_ROBOTS = frozenset(["serve", "token", "audit", "notify", "backup", "restore"])
"""Subcommands about everything that one service has: `--robot` is refused."""


class LazyGroup(typer.core.TyperGroup):
    """Lists subcommands by name and one line; imports the one that is called."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        for name, (_, line) in SUBCOMMANDS.items():
            self.add_command(typer.core.TyperCommand(name, help=line))

    def list_commands(self, ctx: Any) -> list[str]:
        """Names in the order of the table."""
        del ctx
        return list(SUBCOMMANDS)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Imports the command that `args` names."""
        if args and args[0] in SUBCOMMANDS:
            module = import_module(SUBCOMMANDS[args[0]][0])
            command = typer.main.get_command(module.app)
            command.name = args[0]
            _without_rich(command)
            self.add_command(command, args[0])
        return super().resolve_command(ctx, args)


def _without_rich(command: Any) -> None:
    """Makes the help of every level look alike; none of it loads rich."""
    command.rich_markup_mode = None
    for sub in getattr(command, "commands", {}).values():
        _without_rich(sub)
