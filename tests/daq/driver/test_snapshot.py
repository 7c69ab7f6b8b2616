"""What a delivered snapshot says of its joints and of its own age."""

import pytest

from daq.driver.snapshot import BoardSnapshot
from firmware_protocol.codes import StatusFlag
from firmware_protocol.joints import JointReading

SNAPSHOT = BoardSnapshot(
    tick=7,
    flags=StatusFlag(0),
    joints=((1, JointReading(500, 2048, 3, 6)), (3, JointReading(501, 2100, -4, -8))),
    host_time=10.5,
    tick_time=10.2,
    consistent_by="sample",
)


def test_jitter_is_the_delay_after_the_estimated_tick() -> None:
    assert SNAPSHOT.jitter == pytest.approx(0.3)


def test_readings_are_found_by_the_joint_s_number() -> None:
    assert SNAPSHOT.positions == {1: 2048, 3: 2100}
    assert SNAPSHOT.set_points == {1: 500, 3: 501}
    assert SNAPSHOT[3].error == -4
    with pytest.raises(KeyError):
        SNAPSHOT[2]
