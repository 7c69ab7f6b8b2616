"""The running service with two arms, as in tests/server/fleet."""

from tests.server.fleet.test_fleet_service import fleet, running

__all__ = ["fleet", "running"]
