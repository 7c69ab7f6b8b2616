"""`python -m mock_controller`: exit code 0 when interrupted or no longer owned, 2 for wrong options."""

from __future__ import annotations

import gc
import signal
import sys
from types import FrameType

gc.disable()  # collections would take a third of the imports' time, and find nothing

from mock_controller.options import read_options  # noqa: E402 - after that
from mock_controller.server import Server  # noqa: E402

gc.freeze()  # nor would later ones, nor the one at the end
gc.enable()


def main(arguments: list[str]) -> int:
    """Runs the mock until it is interrupted; returns the exit code."""
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        Server(read_options(arguments)).run()
    except KeyboardInterrupt:
        return 0
    except ValueError as error:
        print(f"mock_controller: {error}", file=sys.stderr)
        return 2
    return 0


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
