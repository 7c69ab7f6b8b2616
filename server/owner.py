"""`python -m server.owner`: the owner of a port, for the service, with its logs."""

from daq.owner import process
from server import logs
from server.steady import keep_steady


def main() -> int:
    """Returns the exit code."""
    logs.begin()
    return process.main(keep_steady)


if __name__ == "__main__":
    raise SystemExit(main())
