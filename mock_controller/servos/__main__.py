"""`python -m mock_controller.servos`: a bench in real time on a pseudo-terminal or a TCP port.

Standard input takes commands, one per line: `drop ID`, `back ID`, `fail ID BIT`, `reboot ID`. With `--owned` the bench
ends when standard input ends. Exit code 0 after an interrupt or the end of the input, 2 for wrong options.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import select
import signal
import sys
import time
from pathlib import Path
from types import FrameType

from firmware_protocol.dynamixel.control_table import HardwareError
from firmware_protocol.dynamixel.packets import LARGEST_ID
from mock_controller.ports import Port, PortError, PtyPort, TcpPort, host_and_port
from mock_controller.servos.bench import Bench, Options
from mock_controller.servos.plant import NONE, draw_secret

_STDIN = 0
_WAKE_S = 0.02
"""Longest wait (s) between two advances of the simulation."""


def main(arguments: list[str]) -> int:
    """Runs the bench until it is interrupted; returns the exit code."""
    signal.signal(signal.SIGTERM, _interrupt)
    given = _parser().parse_args(arguments)
    try:
        secret = NONE if given.secret is None else draw_secret(given.secret)
        bench = Bench(Options(_ids(given.ids), given.supply, given.load, given.coulomb, given.torque, secret))
        _serve(bench, PtyPort(given.link) if given.pty else TcpPort(*host_and_port(given.tcp, "tcp")), given.owned)
    except KeyboardInterrupt:
        return 0
    except (ValueError, PortError) as error:
        print(f"mock_controller.servos: {error}", file=sys.stderr)
        return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="mock_controller.servos", description="A bench of two Dynamixel servos.")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--pty", action="store_true", help="listen on a pseudo-terminal")
    where.add_argument("--tcp", default="127.0.0.1:0", help="listen on HOST:PORT (default: any free port)")
    parser.add_argument("--link", type=Path, help="a symbolic link to the pseudo-terminal")
    parser.add_argument("--ids", default="1,2", help="IDs of the servos for pan and tilt")
    parser.add_argument("--supply", type=float, default=12.0, help="supply voltage in V")
    parser.add_argument("--load", type=float, default=0.0, help="mass at the end of the bar in kg")
    parser.add_argument("--coulomb", type=float, default=0.10, help="Coulomb friction of each joint in N·m")
    parser.add_argument(
        "--secret",
        type=int,
        metavar="SEED",
        help="a bench with a secret effect; python -m mock_controller.reveal --servos SEED reveals it",
    )
    parser.add_argument("--torque", action="store_true", help="start with the torque on (default: off, as at power-up)")
    parser.add_argument("--owned", action="store_true", help="end when standard input ends")
    return parser


def _ids(text: str) -> tuple[int, ...]:
    """Raises ValueError for anything but two IDs."""
    parts = text.split(",")
    if len(set(parts)) != 2 or len(parts) != 2 or not all(one.isdecimal() and int(one) <= LARGEST_ID for one in parts):
        raise ValueError(f"ids {text!r}: this bench has two servos, with two different IDs from 0 to {LARGEST_ID}")
    return int(parts[0]), int(parts[1])


def _serve(bench: Bench, port: Port, owned: bool) -> None:
    with contextlib.suppress(BrokenPipeError):
        print(json.dumps({"ready": True, "url": port.url, "control": None}), flush=True)
    zero_us, inputs = time.monotonic_ns() // 1000, [_STDIN]
    try:
        while True:
            readable, _, _ = select.select([*port.watched, *inputs], port.waiting_to_write, [], _WAKE_S)
            bench.advance_to(time.monotonic_ns() // 1000 - zero_us)
            for descriptor in readable:
                if descriptor != _STDIN:
                    port.send(bench.receive(port.read(descriptor) or b""))
                elif not _run_commands(bench, os.read(_STDIN, 4096)):
                    if owned:
                        return
                    inputs = []
            port.send(b"")  # flush bytes that are still waiting
    finally:
        port.cut()


def _run_commands(bench: Bench, said: bytes) -> bool:
    """Runs commands from standard input; returns whether it is still open."""
    for line in said.decode(errors="replace").splitlines():
        match line.split():
            case ["drop", device]:
                bench.gone.add(int(device))
            case ["back", device]:
                bench.gone.discard(int(device))
            case ["fail", device, bit]:
                bench.fail(int(device), HardwareError(1 << int(bit)))
            case ["reboot", device]:
                bench.reboot(int(device))
    return bool(said)


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
