"""Converts the owner's reports to the records that people and programs get."""

from __future__ import annotations

from daq.contracts.frozen import like
from daq.contracts.service.robot import LinkStatus, RobotIdentity, Sample, SampleRate
from daq.driver.line_rate import LineRate, bound_ms, reported_rates, stop_latency_s
from daq.owner.messages import ArmReport, LiveSample
from daq.transport import parse_port_url
from daq.transport.url import BITS_PER_BYTE
from firmware_protocol.commands import StatusFlag


def with_rates(link: LinkStatus, bytes_per_second: float, identity: RobotIdentity) -> LinkStatus:
    """Adds the rates that the line allows to the status of a link. Without SAMPLE no rate is promised."""
    if not identity.samples:
        return link.model_copy(update={"stop_seconds": stop_latency_s(bytes_per_second)})
    rates = tuple(
        _wire(rate) for rate in reported_rates(bytes_per_second, identity.period, can_be_compact=identity.compact)
    )
    return link.model_copy(update={"rates": rates, "stop_seconds": stop_latency_s(bytes_per_second)})


def rates_line(link: LinkStatus) -> str:
    """Returns a line for people; empty if nothing is known."""
    if not link.rates or link.stop_seconds is None:
        return ""
    rates = ", ".join(
        f"{rate.joints} joint{'s' * (rate.joints > 1)} {rate.samples_per_second:.3g}" for rate in link.rates
    )
    return f"samples per second on this line: {rates}; a stop takes up to {bound_ms(link.stop_seconds)} ms"


def _wire(rate: LineRate) -> SampleRate:
    return SampleRate(
        joints=rate.joints,
        every=rate.every,
        samples_per_second=round(rate.samples_per_second, 3),
        share=round(rate.share, 3),
    )


def link_of(arm: ArmReport, age: float, url: str, identity: RobotIdentity) -> LinkStatus:
    """Returns the state of the link at `url` from a report of this age (s), with the rates that the link allows."""
    link = LinkStatus(state=arm.link, counters=arm.counters, age=age)
    return with_rates(link, parse_port_url(url).baud / BITS_PER_BYTE, identity)


def sample_of(sample: LiveSample, now: float, utc: float) -> Sample:
    """Returns a sample with its age. `now` (monotonic) and `utc` (wall clock) are the same moment (s)."""
    age = now - sample.host_time
    return like(Sample, sample, utc=utc - age, age=age, frozen=bool(sample.status & StatusFlag.FROZEN.value))
