"""Converts the owner's reports to the records that people and programs get."""

from __future__ import annotations

from daq.contracts.frozen import like
from daq.contracts.service.robot import LinkStatus, RobotIdentity, Sample
from daq.owner.messages import ArmReport, LiveSample
from daq.runner.line_status import with_rates
from daq.transport import parse_port_url
from daq.transport.url import BITS_PER_BYTE
from firmware_protocol.commands import StatusFlag


def link_of(arm: ArmReport, age: float, url: str, identity: RobotIdentity) -> LinkStatus:
    """Returns the state of the link at `url` from a report of this age (s), with the rates that the link allows."""
    link = LinkStatus(state=arm.link, counters=arm.counters, age=age)
    return with_rates(link, parse_port_url(url).baud / BITS_PER_BYTE, identity)


def sample_of(sample: LiveSample, now: float, utc: float) -> Sample:
    """Returns a sample with its age. `now` (monotonic) and `utc` (wall clock) are the same moment (s)."""
    age = now - sample.host_time
    return like(Sample, sample, utc=utc - age, age=age, frozen=bool(sample.status & StatusFlag.FROZEN.value))
