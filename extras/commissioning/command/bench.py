"""Shared parts of the commissioning steps: the folder, the port, the person, and reading of registers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from extras.commissioning.command.record import Record
from extras.commissioning.memory.procedure import Operator

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from daq.driver import Controller
    from firmware_protocol.memory_map import MemoryMap

CONFIG, MAP, FINDINGS, MACHINE = "daq.toml", "memory_map.toml", "memory_findings.json", "machine.toml"


class NotCommissionedError(DaqError):
    """The result of a step does not permit the next one."""

    exit_code = exit_codes.NOT_REACHED


class Commissioner(Operator, Protocol):
    """The person at the arm, who also reads a protractor."""

    def may_begin(self, *, at_the_arm: bool, yes: bool) -> bool:
        """Whether a step may begin; False to leave it open. Asked for every step at the arm, whatever `yes` is."""

    def read_angle(
        self, joint: int, number: int, wait: Callable[[float], None]
    ) -> float | Literal["taken back"] | None:
        """Returns the angle (degrees) of a joint at posture `number`, to which the person moved it by hand.

        None for no more postures; "taken back" if the previous one was read wrongly. `wait` lets time (s) pass.
        """


@dataclass
class Bench:
    """State that the steps share: the folder of the arm, the port, the person, and results."""

    call: Invocation
    folder: Path
    operator: Commissioner
    consent: ConsentPrompt
    record: Record
    joints: tuple[int, ...] = (1, 2, 3)
    postures: int = 6

    @property
    def configured(self) -> Invocation:
        """Returns an invocation that uses the files that the steps have written."""
        return Invocation(config_file=self.folder / CONFIG, port_option=self.call.port)

    def adapter(self) -> str | None:
        """Serial number of the USB adapter at the port; None without one, or for a port that is not serial."""
        from daq.transport.discovery import ports

        device = self.call.port.partition("?")[0]
        return next((one.serial_number for one in ports() if one.url == device), None)

    def memory_map(self) -> MemoryMap:
        """Returns the memory map that was found, or the configured one."""
        from daq.config.robot_files import load_memory_map

        path = self.folder / MAP
        return load_memory_map(path if path.exists() else self.call.settings.robot.memory_map)

    def machine(self) -> Machine:
        """Returns the present machine file: this arm's, or the configured one before any measurement."""
        from daq.contracts.machine import load_machine

        own = self.folder / MACHINE
        return load_machine(str(own) if own.exists() else self.call.settings.robot.machine)

    def write_machine(self, machine: Machine) -> None:
        """Writes this arm's machine file, and daq.toml that names it."""
        from daq.config.machine_text import machine_text
        from daq_cli.app.output_file import replacing

        with replacing(self.folder / MACHINE) as part:
            part.write_text(machine_text(machine), "utf-8")
        self.configure()

    def basis(self) -> dict[str, str]:
        """Returns the basis of a result: the port, and the present memory map and machine file."""
        files = {"memory_map": self.folder / MAP, "machine": self.folder / MACHINE}
        return {"port": self.call.port} | {
            name: sha256(path.read_bytes()).hexdigest()[:16] if path.exists() else "none"
            for name, path in files.items()
        }

    def configure(self) -> None:
        """Writes daq.toml with the present files."""
        from daq.config.toml_text import settings_text
        from daq_cli.app.output_file import replacing

        settings = self.call.settings
        changes: dict[str, Any] = {"port": self.call.port}
        if (self.folder / MAP).exists():
            changes["memory_map"] = (self.folder / MAP).absolute()
        if (self.folder / MACHINE).exists():
            changes["machine"] = str((self.folder / MACHINE).absolute())
        robot = settings.robot.model_copy(update=changes)
        traces = settings.traces.model_copy(update={"folder": (self.folder / "traces").absolute()})
        with replacing(self.folder / CONFIG) as part:
            part.write_text(settings_text(settings.model_copy(update={"robot": robot, "traces": traces})), "utf-8")


def connected(bench: Bench) -> Controller:
    from daq.driver import Controller

    return Controller.connect(bench.call.port, bench.memory_map())
