"""The mock's board behind the bridge in C, at a port: `python -m tests.firmware.serve BRIDGE [options of the mock]`.

BRIDGE is `hosted`, the core as a shared library of this computer, or `mega2560`, the firmware of that board on a
simulated one. Everything else is the mock's: `--pty`, `--no-sample`, `--start`, its control port. The bridge is built
for the map that `--memory-map` names, or for the one that ships.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from mock_controller.device import Device, build_device
from mock_controller.options import Options, read_options
from mock_controller.server import Server
from tests.firmware.hosted_link import HostedLink
from tests.firmware.mega_link import MegaLink, board_on_the_bus


def _hosted(device: Device, options: Options) -> Any:
    return HostedLink(device, sees_period=options.sample, memory_map=options.memory_map)


def _mega2560(device: Device, options: Options) -> Any:
    return MegaLink(device, options.memory_map)


LINKS: dict[str, Callable[[Device, Options], Any]] = {"hosted": _hosted, "mega2560": _mega2560}


def main(arguments: list[str]) -> int:
    """Serves until interrupted; the exit code."""
    if not arguments or arguments[0] not in LINKS:
        print(__doc__, file=sys.stderr)
        return 2
    name = arguments[0]

    def build(options: Options, disconnect: Callable[[float], None]) -> Device:
        options = board_on_the_bus(options) if name == "mega2560" else options
        device = build_device(options, disconnect)
        return replace(device, link=LINKS[name](device, options))

    try:
        Server(read_options(arguments[1:]), build).run()
    except KeyboardInterrupt:
        return 0
    except ValueError as error:
        print(f"serve: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
