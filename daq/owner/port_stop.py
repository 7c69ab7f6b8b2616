"""Stops an arm directly through its port, if no process of this user owns the port."""

from __future__ import annotations

from daq.contracts.errors import DaqError
from daq.contracts.limp import limp_line
from daq.link import Link, LinkError, RequestRefusedError
from daq.owner.stop_socket import StopAnswer
from firmware_protocol.commands import Gains, ReportGains


def stop_at_port(robot: str, url: str) -> StopAnswer:
    """Opens the port, freezes the arm and closes the port. Never raises: the answer states the result."""
    try:
        with Link.open(url) as link:
            stopped = link.stop()
            limp = _limp(link)
    except LinkError as error:
        return StopAnswer(robot=robot, port=url, delivered=error.sent, confirmed=False, text=str(error))
    except RequestRefusedError as error:
        return StopAnswer(robot=robot, port=url, delivered=True, confirmed=False, text=str(error))
    except DaqError as error:
        return StopAnswer(robot=robot, port=url, delivered=False, confirmed=False, text=str(error))
    return StopAnswer(
        robot=robot,
        port=url,
        delivered=True,
        confirmed=True,
        tick=stopped.tick,
        postures=tuple(stopped.postures),
        text=limp,
    )


def _limp(link: Link) -> str:
    """Names the limp joints. Returns an empty text if the board does not report gains."""
    try:
        gains = link.request(ReportGains(), Gains).gains
    except (LinkError, RequestRefusedError):
        return ""
    return limp_line(dict(enumerate(gains, start=1)))
