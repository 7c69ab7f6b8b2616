"""`daq status` of a server's robot."""

from __future__ import annotations

import math

from daq.contracts.limp import limp_line
from daq.contracts.status import report_of
from daq_cli.app.context import Invocation, print_json, printable
from daq_cli.robot.remote.robot import remote_robot


def show_status(call: Invocation, as_json: bool) -> None:
    """As the service knows it now; what is old says how old it is."""
    with remote_robot(call) as robot:
        found = robot.status()
        gains = robot.gains().gains if found.limp else {}
    if as_json:
        assert call.server is not None
        print_json(report_of(found, call.server).model_dump(mode="json"))
        return
    if found.identity is None:
        problem = f": {found.connection_problem}" if found.connection_problem else ""
        print(printable(f"{found.robot}: {found.connection}{problem}"))
    else:
        kind = "mock" if found.identity.simulated else "REAL ARM"
        tick = "" if found.sample is None else f", tick {found.sample.tick}, {found.sample.age * 1e3:.0f} ms old"
        cause = f" ({found.cause})" if found.cause else ""
        print(printable(f"{kind}{tick}, {found.arm}{cause}; {found.activity}; link {found.link.state}"))
    if found.sample is not None:
        one = found.sample
        for joint, *angles in zip(one.joints, one.position, one.set_point, one.error, strict=True):
            position, aim, error = map(math.degrees, angles)
            print(f"  joint {joint}: {position:8.2f}°   set point {aim:8.2f}°   error {error:6.2f}°")
    queue = found.queue
    state = f"paused: {queue.reason}" if queue.paused else "open"
    print(printable(f"queue {state}; {queue.queued} waiting" + (f"; {queue.running} runs" if queue.running else "")))
    holder = found.control.name if found.control.holder == "client" else found.control.holder
    print(printable(f"control: {holder}"))
    if found.limp:
        print(limp_line(gains))
