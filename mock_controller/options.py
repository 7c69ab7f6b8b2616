"""Options of the mock, from the command line."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from firmware_protocol.invalid import first_invalid
from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import GAIN_MAX, POSTURE_UNITS

Posture = Annotated[int, Field(ge=0, lt=POSTURE_UNITS)]
Gain = Annotated[int, Field(ge=0, le=GAIN_MAX)]


class OptionsError(ValueError):
    """An invalid option; the message is one line that names it and the allowed values."""


class Options(BaseModel):
    """All options of one mock."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    pty: bool = False
    link: Path | None = None
    tcp: str | None = None
    control: str = "127.0.0.1:0"
    owned: bool = False
    waits: bool = False
    lock_step: bool = False
    sample: bool = True
    compact: bool = True
    baud: Annotated[int, Field(ge=300, le=4_000_000)] | None = None
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    start: Annotated[tuple[Posture, ...], Field(min_length=JOINTS, max_length=JOINTS)] | None = None
    gains: tuple[Gain, Gain, Gain] | None = None
    memory_map: Path | None = None
    plant: Path | None = None
    board: Path | None = None
    modify: tuple[str, ...] = ()
    secret: Annotated[int, Field(ge=0, lt=2**63)] | None = None
    secret_map: Annotated[int, Field(ge=0, lt=2**63)] | None = None
    secret_sensors: Annotated[int, Field(ge=0, lt=2**63)] | None = None
    documented: Literal["kept", "moved"] = "kept"
    fault: tuple[str, ...] = ()


def read_options(arguments: list[str], *, listens: bool = True) -> Options:
    """Returns options from command-line arguments.

    Options for a mock that `listens` need an address.

    Raises OptionsError; `--help` prints and exits (SystemExit).
    """
    given = vars(_parser().parse_args(arguments))
    if given.pop("help_faults"):
        from mock_controller.faults.registry import table

        print(table())
        raise SystemExit(0)
    if given.pop("help_modifications"):
        from mock_controller.modifications.registry import table as modifications_table

        print(modifications_table())
        raise SystemExit(0)
    try:
        options = Options.model_validate({key: value for key, value in given.items() if value is not None})
    except ValidationError as error:
        first = first_invalid(error)
        where = " ".join(map(str, first.place)).replace("_", "-")
        raise OptionsError(f"{where}: {first.message.lower()}, is {_shown(first.value)}") from None
    if options.pty and options.tcp:
        raise OptionsError("pty and tcp: give only one of them")
    if listens and not (options.pty or options.tcp):
        raise OptionsError("no address: give --pty or --tcp HOST:PORT")
    if options.secret is not None and options.modify:
        raise OptionsError("secret and modify: give only one of them")
    if options.link is not None and not options.pty:
        raise OptionsError("link: a name for the pseudo-terminal needs --pty")
    return options


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _numbers(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]


class _Parser(argparse.ArgumentParser):
    """Reports errors in one line."""

    def error(self, message: str) -> Any:
        raise OptionsError(message)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="python -m mock_controller",
        description="An MA2000 arm with its motor controller, reached through a pseudo-terminal or a TCP port. "
        "Prints one JSON line with its addresses when it is ready, and runs until it is interrupted.",
        argument_default=None,
        allow_abbrev=False,
    )
    where = parser.add_argument_group("address (one connection at a time)")
    where.add_argument("--pty", action="store_true", default=None, help="a pseudo-terminal in raw mode")
    where.add_argument("--link", type=Path, metavar="PATH", help="symbolic link to the pseudo-terminal")
    where.add_argument("--tcp", metavar="HOST:PORT", help="a TCP port; 127.0.0.1:0 takes any free one")
    where.add_argument(
        "--control",
        metavar="ADDRESS",
        help="control port: HOST:PORT or unix:PATH (default 127.0.0.1:0), none for no control port",
    )
    where.add_argument("--owned", action="store_true", default=None, help="end when standard input ends")
    where.add_argument(
        "--waits",
        action="store_true",
        default=None,
        help="stop the board's clock while this process gets no processor; standard output reports how long",
    )

    time = parser.add_argument_group("time and line")
    time.add_argument(
        "--lock-step",
        action="store_true",
        default=None,
        help="board time moves only when the host asks; runs repeat exactly",
    )
    time.add_argument("--baud", type=int, metavar="N", help="bytes take as long as on a line of N baud (off)")
    time.add_argument(
        "--no-sample",
        dest="sample",
        action="store_false",
        default=None,
        help="a bridge that does not see the controller's period: no consistent snapshots",
    )
    time.add_argument(
        "--no-compact",
        dest="compact",
        action="store_false",
        default=None,
        help="a bridge that does not support the compact request for slow lines",
    )

    machine = parser.add_argument_group("the machine")
    machine.add_argument("--seed", type=int, metavar="N", help="seed of all random numbers (0)")
    machine.add_argument("--start", type=_numbers, metavar="P1,…,P6", help="start posture, six posture units 0-999")
    machine.add_argument("--gains", type=_numbers, metavar="P,I,D", help="default gains of all joints, 0-20 (2,0,0)")
    machine.add_argument("--memory-map", type=Path, metavar="FILE", help="another memory map (TOML)")
    machine.add_argument("--plant", type=Path, metavar="FILE", help="another arm (TOML)")
    machine.add_argument("--board", type=Path, metavar="FILE", help="another motor controller (TOML)")
    machine.add_argument(
        "--modify", action="append", metavar="NAME:KEY=VALUE,…", help="a hidden physical effect; may be repeated"
    )
    machine.add_argument(
        "--secret",
        type=int,
        metavar="SEED",
        help="an arm with secret tolerances and effects; python -m mock_controller.reveal SEED shows them",
    )

    machine.add_argument(
        "--secret-map",
        type=int,
        metavar="SEED",
        help="registers at secret addresses, others between them; --memory-map is then the bridge's. "
        "python -m mock_controller.reveal --memory-map SEED shows the truth",
    )
    machine.add_argument(
        "--secret-sensors",
        type=int,
        metavar="SEED",
        help="potentiometers of secret direction, zero and range. "
        "python -m mock_controller.reveal --sensors SEED shows the truth",
    )
    machine.add_argument(
        "--documented",
        choices=("kept", "moved"),
        help="whether a secret map keeps the six documented addresses (kept)",
    )

    parser.add_argument("--fault", action="append", metavar="NAME:KEY=VALUE,…", help="a fault; may be repeated")
    parser.add_argument("--help-faults", action="store_true", help="list faults and their parameters, and exit")
    parser.add_argument("--help-modifications", action="store_true", help="list hidden effects likewise, and exit")
    return parser
