"""Routes for all robots: overview, and the stop of all."""

from __future__ import annotations

import asyncio

from daq.contracts.frozen import like
from daq.contracts.service.fleet import FleetRobot, FleetStatus
from daq.contracts.service.robot import FleetStopResult
from server.api.dependencies import ClockDep, Robots, Viewer
from server.problems import PROBLEMS
from server.robot_services import RobotServices
from server.routes import Router
from server.stopping.arm import together

router = Router(prefix="/fleet", tags=["fleet"], responses=PROBLEMS)


@router.get("")
async def get_fleet(robots: Robots, clock: ClockDep, _: Viewer) -> FleetStatus:
    """Returns an overview of every robot, with the age of its newest sample."""
    return FleetStatus(utc=clock.utc(), robots=tuple(map(_at_a_glance, robots)))


@router.post("/stop", responses={200: {"description": "The outcome of the stops: read `confirmed`"}})
async def stop_fleet(robots: Robots, caller: Viewer) -> FleetStopResult:
    """Freezes every arm of this service at once. Everybody who may see the robots may stop them, without control.

    Unless the answer is `confirmed`, use the emergency stops. Only a reset of each arm ends its freeze.
    """
    for rig in robots:
        rig.queue.stop_asked(caller.spoken)  # first, so that nothing begins while the stops are under way
    results = await asyncio.gather(*(rig.stop.stop() for rig in robots))
    found = {rig.robot.name: result for rig, result in zip(robots, results, strict=True)}
    for rig in robots:
        result = found[rig.robot.name]
        rig.record_event_later("stop", result.text, actor=caller.name)
    return together(found)


def _at_a_glance(rig: RobotServices) -> FleetRobot:
    status = rig.status()
    running = rig.queue.running
    return like(
        FleetRobot,
        status,
        simulated=None if status.identity is None else status.identity.simulated,
        sample_age=None if status.sample is None else status.sample.age,
        progress=None if running is None else running.progress,
        unattended=rig.unattended,
    )
