"""Hypothesis strategies for every message and for what a line does to bytes."""

from typing import TypeVar

from hypothesis import strategies as st

from firmware_protocol import commands as c
from firmware_protocol.joints import ALL_JOINTS, CompactReading, JointReading
from firmware_protocol.message import Reply, Request

T = TypeVar("T")
u8, u16, u32, u64 = (st.integers(0, (1 << bits) - 1) for bits in (8, 16, 32, 64))
masks = st.integers(1, ALL_JOINTS)
joint_sets = st.sets(st.integers(1, 6), min_size=1).map(sorted)
readings = st.builds(
    JointReading,
    set_point=st.integers(0, 1023),
    position=st.integers(0, 4095),
    error=st.integers(-0x8000, 0x7FFF),
    power=st.integers(-0x80, 0x7F),
)

compact_readings = st.builds(
    CompactReading, position=st.integers(0, 4095), error=st.integers(-2048, 2047), power=st.integers(-0x80, 0x7F)
)


def of_joints(values: st.SearchStrategy[T]) -> st.SearchStrategy[tuple[tuple[int, T], ...]]:
    """(joint, value) for some joints, ascending."""
    return joint_sets.flatmap(lambda joints: st.tuples(*(st.tuples(st.just(joint), values) for joint in joints)))


gain = st.integers(0, 20)
postures = st.integers(0, 999)

REQUESTS: dict[type[Request], st.SearchStrategy[Request]] = {
    c.Hello: st.builds(c.Hello, st.just(c.PROTOCOL_VERSION), u32),
    c.ReadBlock: st.builds(c.ReadBlock, st.integers(0, 0xFFFF - 47), st.integers(1, 48)),
    c.WriteBlock: st.builds(c.WriteBlock, st.integers(0, 0xFFFF - 37), st.binary(min_size=1, max_size=38)),
    c.WriteSetPoints: st.builds(c.WriteSetPoints, of_joints(postures)),
    c.ReportGains: st.builds(c.ReportGains),
    c.SetGains: st.builds(c.SetGains, st.integers(1, 6), gain, gain, gain),
    c.ReportErrorsPositionsPowers: st.builds(c.ReportErrorsPositionsPowers, masks),
    c.Sample: st.builds(c.Sample, u32, masks),
    c.MoveAndSample: st.builds(c.MoveAndSample, u32, masks, st.one_of(st.just(()), of_joints(postures))),
    c.Stop: st.builds(c.Stop),
    c.Release: st.builds(c.Release, u32),
    c.ReadProcess: st.builds(c.ReadProcess),
    c.WriteOutputs: st.builds(c.WriteOutputs, u8, u8),
    c.SetGripper: st.builds(c.SetGripper, st.integers(0, 1)),
    c.ReadStatus: st.builds(c.ReadStatus),
    c.Advance: st.builds(c.Advance, u32),
}
REPLIES: dict[type[Reply], st.SearchStrategy[Reply]] = {
    c.HelloReply: st.builds(c.HelloReply, u8, u16, u32, u8, u16, u32, st.integers(1, 0xFFFFFFFF)),
    c.Block: st.builds(c.Block, st.binary(min_size=1, max_size=48)),
    c.BlockWritten: st.builds(c.BlockWritten),
    c.SetPointsTaken: st.builds(c.SetPointsTaken, u32, u8),
    c.Gains: st.builds(c.Gains, st.tuples(*[st.tuples(u8, u8, u8)] * 6)),
    c.GainsSet: st.builds(c.GainsSet),
    c.ErrorsPositionsPowers: st.builds(c.ErrorsPositionsPowers, of_joints(readings)),
    c.Snapshot: st.builds(c.Snapshot, u32, u8, of_joints(readings)),
    c.CompactSnapshot: st.builds(c.CompactSnapshot, u32, u8, u8, of_joints(compact_readings)),
    c.Stopped: st.builds(c.Stopped, u32, st.tuples(*[postures] * 6)),
    c.Released: st.builds(c.Released),
    c.Process: st.builds(c.Process, u8, u8, u8),
    c.OutputsWritten: st.builds(c.OutputsWritten),
    c.GripperSet: st.builds(c.GripperSet),
    c.Status: st.builds(c.Status, u32, u8, u16, u32, u32),
    c.Advanced: st.builds(c.Advanced, u64, u32),
    c.Refused: st.builds(c.Refused, u8, u8),
}
replies = st.one_of(*REPLIES.values())


@st.composite
def cut(draw: st.DrawFn, data: bytes) -> list[bytes]:
    """The same bytes in pieces, as an operating system may hand them over."""
    places = sorted(draw(st.lists(st.integers(0, len(data)), max_size=12)))
    return [data[a:b] for a, b in zip([0, *places], [*places, len(data)], strict=True)]
