"""Servos behind the driver: what each request does to them, and one clear line for each thing that goes wrong."""

from itertools import pairwise

import pytest

from daq.driver import Controller, ControllerRestartedError, HardwareFaultError, NoSampleError
from daq.link import LinkTimeoutError, RequestRefusedError
from firmware_protocol import commands as c
from firmware_protocol.commands import ExplainedRefusal
from firmware_protocol.dynamixel import instructions as ask
from firmware_protocol.dynamixel.control_table import TICKS, HardwareError, Table
from firmware_protocol.dynamixel.dialect import DynamixelDialect
from firmware_protocol.dynamixel.packets import HEADER, encode
from firmware_protocol.errors import ProtocolError
from mock_controller.servos.bench import Options
from tests.daq.servo_bench import VirtualBench


@pytest.fixture
def bench() -> VirtualBench:
    return VirtualBench()


@pytest.fixture
def controller(bench: VirtualBench) -> Controller:
    return bench.controller()


def goals(bench: VirtualBench) -> list[int]:
    return [servo[Table.GOAL_POSITION] for servo in bench.bench.servos]


def positions(bench: VirtualBench) -> list[int]:
    return [servo[Table.PRESENT_POSITION] for servo in bench.bench.servos]


def test_a_bench_says_what_it_is_and_looking_writes_nothing(controller: Controller, bench: VirtualBench) -> None:
    assert controller.identity.simulated
    assert c.Capability.POLLED in controller.identity.capabilities
    assert controller.period_s == 0.001
    assert controller.joints == (1, 2)
    assert controller.gains() == {1: (800, 0, 0), 2: (800, 0, 0)}
    written: list[bytes] = []
    bench.hearing = lambda data: written.append(data) or data  # type: ignore[func-returns-value]
    with bench.controller() as looking:
        looking.status()
        looking.next_snapshot()
    assert all(packet[7] == ask.Instruction.SYNC_READ for packet in written)


def test_set_points_are_goals_and_a_stop_holds_the_servos(controller: Controller, bench: VirtualBench) -> None:
    controller.set_points({1: 2100, 2: 1600})
    assert goals(bench) == [2100, 1600]
    snapshot = controller.next_snapshot()
    assert snapshot.set_points == {1: 2100, 2: 1600}
    assert not snapshot.set_points_missed
    reading = snapshot[1]
    assert reading.error == 2100 - reading.position
    controller.set_points({1: 2600})
    bench.sleep_until(bench.now() + 0.15)
    stopped = controller.stop()
    assert stopped.acknowledged
    assert list(stopped.frozen.values()) == goals(bench)
    assert all(abs(goal - position) < 40 for goal, position in zip(goals(bench), positions(bench), strict=True))
    with pytest.raises(RequestRefusedError, match="the bench has been stopped and holds its posture"):
        controller.set_points({1: 2600})
    assert goals(bench) == list(stopped.frozen.values())


def test_samples_have_the_tick_of_their_measurement_by_the_servos(controller: Controller, bench: VirtualBench) -> None:
    # Samples come every twentieth tick of the servos own clock
    ticks = [controller.next_snapshot().tick]
    for _ in range(50):
        ticks.append(controller.next_snapshot(ticks[-1] + 19).tick)
    assert {later - earlier for earlier, later in pairwise(ticks)} <= {19, 20, 21}
    assert abs(ticks[-1] - ticks[0] - 50 * 20) <= 1  # a sample beside its tick does not move those after it
    # Every tick can be asked for
    tick = controller.next_snapshot().tick
    for _ in range(5):
        later = controller.next_snapshot(tick).tick
        assert tick < later <= tick + 3
        tick = later
    # A sample has the tick at which it was measured
    clocks: list[int] = []
    bench.saying = lambda data: clocks.append(bench.bench.servos[0][Table.REALTIME_TICK]) or data  # type: ignore[func-returns-value]
    seen: list[tuple[int, int]] = []
    sample = controller.next_snapshot()
    for pause in range(40):
        bench.sleep_until(bench.now() + 0.004 * (pause % 7))  # a host that is now and then a little late
        sample = controller.next_snapshot(sample.tick + 19)
        seen.append((sample.tick, clocks[-1]))
        assert sample.missing_before == 0
    assert {later - earlier for (earlier, _), (later, _) in pairwise(seen)} >= {20, 24}
    assert len({(tick - clock) % TICKS for tick, clock in seen}) == 1


def test_a_repeat_of_set_points_cannot_undo_a_stop(controller: Controller, bench: VirtualBench) -> None:
    dialect = DynamixelDialect((1, 2))
    late = c.FineSetPoints(((1, 2600),), 4096)
    frame = dialect.encode(7, late)
    assert dialect.again(late, frame) == frame
    dialect.encode(8, c.Stop())
    bench.bench.receive(dialect.again(late, frame))
    assert goals(bench)[0] != 2600


def test_set_points_from_before_a_stop_are_not_repeated_after_its_release(bench: VirtualBench) -> None:
    dialect = DynamixelDialect((1, 2))
    dialect.feed(bench.bench.receive(dialect.encode(1, c.Hello(2, 1))))
    late = c.FineSetPoints(((1, 2600),), 4096)
    lost = dialect.encode(2, late)
    replies = {}
    for request, sequence in ((c.Stop(), 3), (c.Release(1), 4)):
        coming = bench.bench.receive(dialect.encode(sequence, request))
        for _ in range(3):
            bench.sleep_until(bench.now() + 0.002)
            replies |= {number: reply for number, reply in dialect.feed(coming) if number != 2}
            coming = bench.bench.receive(dialect.answer())
    assert isinstance(replies[4], c.Released)
    bench.bench.receive(dialect.again(late, lost))
    assert goals(bench)[0] != 2600


def test_a_stop_is_remembered_by_every_host_until_a_release(bench: VirtualBench) -> None:
    # A stop lasts for other hosts until it is released
    with bench.controller() as first:
        first.set_points({1: 2300})
        assert first.stop().acknowledged
    bench.sleep_until(bench.now() + 5.0)
    with bench.controller() as second:
        status = second.status()
        assert c.StatusFlag.FROZEN in status.flags
        assert status.stop == 1
        second.release(status.stop)
        assert c.StatusFlag.FROZEN not in second.status().flags
        second.set_points({1: 2100})
    assert goals(bench)[0] == 2100
    # A greeting does not forget a stop under way
    dialect = DynamixelDialect((1, 2))
    dialect.encode(1, c.Stop())
    dialect.feed(bench.bench.receive(dialect.encode(2, c.Hello(2, 1))))
    late = c.FineSetPoints(((1, 2600),), 4096)
    bench.bench.receive(dialect.encode(3, late))
    assert goals(bench)[0] != 2600


def test_a_stop_by_another_host_is_remembered_until_a_release(controller: Controller, bench: VirtualBench) -> None:
    controller.set_points({1: 2300})
    with bench.controller() as other:
        assert other.stop().acknowledged
    assert c.StatusFlag.FROZEN in controller.status().flags
    for servo in bench.bench.servos:
        servo.write(Table.BUS_WATCHDOG.address, b"\0")
    held = goals(bench)
    with pytest.raises(RequestRefusedError, match="the bench has been stopped"):
        controller.set_points({1: 2600})
    assert goals(bench) == held
    controller.release(controller.status().stop)
    controller.set_points({1: 2600})


def test_a_release_that_names_an_older_stop_is_refused(controller: Controller, bench: VirtualBench) -> None:
    assert controller.stop().acknowledged
    first = controller.status().stop
    assert controller.stop().acknowledged
    with pytest.raises(RequestRefusedError, match="stop 2 is newer than the one to be ended"):
        controller.release(first)
    assert c.StatusFlag.FROZEN in controller.status().flags
    controller.release(first + 1)
    assert c.StatusFlag.FROZEN not in controller.status().flags


@pytest.mark.parametrize("steps", range(3))
def test_a_stop_ends_the_steps_of_a_release_under_way(steps: int) -> None:
    bench = VirtualBench(Options(torque=False))
    dialect = DynamixelDialect((1, 2))
    dialect.feed(bench.bench.receive(dialect.encode(1, c.Hello(2, 1))))
    coming = bench.bench.receive(dialect.encode(2, c.Release(0)))
    for _ in range(steps):
        assert dialect.feed(coming) == []
        bench.sleep_until(bench.now() + 0.002)
        coming = bench.bench.receive(dialect.answer())
    torque = bench.bench.servos[0].torque
    dialect.feed(coming)
    coming = bench.bench.receive(dialect.encode(3, c.Stop()))
    replies = {}
    for _ in range(4):
        replies |= dict(dialect.feed(coming))
        bench.sleep_until(bench.now() + 0.002)
        coming = bench.bench.receive(dialect.answer())
    assert isinstance(replies[3], c.Stopped)
    if steps < 2:
        assert isinstance(replies[2], ExplainedRefusal)
        assert bench.bench.servos[0].torque == torque
    assert all(servo[Table.BUS_WATCHDOG] == 1 for servo in bench.bench.servos)


def test_a_stop_of_another_host_between_the_steps_of_a_release_holds() -> None:
    bench = VirtualBench(Options(torque=False))
    with bench.controller() as controller:

        def stopped_before_the_torque(data: bytes) -> bytes:
            written = (ask.Instruction.SYNC_WRITE, Table.TORQUE_ENABLE.address)
            if written in map(item_of, each_packet(data)):
                for servo in bench.bench.servos:
                    servo.write(Table.BUS_WATCHDOG.address, b"\1")
            return data

        bench.hearing = stopped_before_the_torque
        with pytest.raises(RequestRefusedError, match="stop 1 is newer"):
            controller.release(controller.status().stop)
        assert c.StatusFlag.FROZEN in controller.status().flags


def test_a_release_that_was_given_up_takes_no_further_step() -> None:
    bench = VirtualBench(Options(torque=False))
    with bench.controller() as controller:
        bench.bench.gone.add(2)
        with pytest.raises(LinkTimeoutError):
            controller.link.request(c.Release(0), c.Released)
        bench.bench.gone.clear()
        controller.status()
        bench.sleep_until(bench.now() + 0.1)
        controller.status()
        assert not any(servo.torque for servo in bench.bench.servos)


def test_a_stop_needs_no_greeting(bench: VirtualBench) -> None:
    with bench.controller() as controller:
        link = controller.link
        link._connection._dialect.reset()
        assert len(link.stop().postures) == 2


def test_torque_comes_on_by_a_release_alone_and_moves_nothing() -> None:
    bench = VirtualBench(Options(torque=False, load=0.2))
    far = bench.bench.servos[0]
    far.write(Table.GOAL_POSITION.address, (100).to_bytes(4, "little"))  # what another program has left
    with bench.controller() as controller:
        assert c.StatusFlag.NO_TORQUE in controller.status().flags
        with pytest.raises(RequestRefusedError, match="the torque of servo 1, 2 is off"):
            controller.set_points({1: 2048})
        before = positions(bench)
        controller.release(controller.status().stop)
        bench.sleep_until(bench.now() + 0.5)
        assert all(servo.torque for servo in bench.bench.servos)
        assert all(abs(now - then) < 25 for now, then in zip(positions(bench), before, strict=True))


def item_of(packet: bytes) -> tuple[int, int]:
    """Instruction and address of one packet of the host's."""
    return packet[7], int.from_bytes(packet[8:10], "little")


def each_packet(data: bytes) -> list[bytes]:
    return [HEADER + piece for piece in data.split(HEADER)[1:]]


def without(data: bytes, item: Table) -> bytes:
    """What is heard when the Sync Writes to this item are damaged on the bus."""
    lost = (ask.Instruction.SYNC_WRITE, item.address)
    return b"".join(packet for packet in each_packet(data) if item_of(packet) != lost)


def test_no_torque_comes_on_while_a_goal_has_not_arrived() -> None:
    bench = VirtualBench(Options(torque=False))
    for servo in bench.bench.servos:
        servo.write(Table.GOAL_POSITION.address, (100).to_bytes(4, "little"))
    with bench.controller() as controller:
        damage = iter(range(10**6))
        bench.hearing = lambda data: without(data, Table.GOAL_POSITION) if next(damage) < 6 else data
        torques: list[bool] = []
        bench.saying = lambda data: torques.append(bench.bench.servos[0].torque and goals(bench)[0] == 100) or data  # type: ignore[func-returns-value]
        before = positions(bench)
        controller.release(controller.status().stop)
        bench.sleep_until(bench.now() + 0.5)
        assert not any(torques)
        assert all(servo.torque for servo in bench.bench.servos)
        assert all(abs(now - then) < 25 for now, then in zip(positions(bench), before, strict=True))
        bench.bench.reboot(1)
        bench.hearing = lambda data: without(data, Table.GOAL_POSITION)
        bench.bench.servos[0].write(Table.GOAL_POSITION.address, (100).to_bytes(4, "little"))
        with pytest.raises(LinkTimeoutError):
            controller.release(controller.status().stop)
        assert not bench.bench.servos[0].torque


def test_a_limp_servo_outside_its_limits_gets_no_torque_and_stops_at_the_limit() -> None:
    bench = VirtualBench(Options(torque=False))
    servo = bench.bench.servos[1]
    servo.write(Table.MIN_POSITION_LIMIT.address, (3000).to_bytes(4, "little"))
    with bench.controller() as controller:
        with pytest.raises(RequestRefusedError, match=r"joint 2: servo 2 stands at .* outside its position limits"):
            controller.release(controller.status().stop)
        assert not servo.torque
    bench = VirtualBench(Options(torque=False))
    bench.bench.servos[1].write(Table.MIN_POSITION_LIMIT.address, (3000).to_bytes(4, "little"))
    with bench.controller() as controller:
        stopped = controller.stop()
    assert stopped.acknowledged
    assert stopped.frozen[2] == goals(bench)[1] == 3000


def test_a_stop_whose_answers_are_all_lost_still_stops(controller: Controller, bench: VirtualBench) -> None:
    controller.set_points({1: 3000})
    bench.sleep_until(bench.now() + 0.1)
    bench.saying = lambda _data: b""
    before = positions(bench)[0]
    assert not controller.stop().acknowledged
    assert positions(bench)[0] - before < 120
    bench.saying = lambda data: data
    assert c.StatusFlag.FROZEN in controller.status().flags


def test_a_stop_asks_anew_when_it_is_repeated(bench: VirtualBench) -> None:
    with bench.controller() as controller:
        controller.set_points({1: 2600})
        damage = iter(range(10**6))
        bench.hearing = lambda data: without(data, Table.GOAL_POSITION) if next(damage) < 30 else data
        assert controller.stop().acknowledged
    dialect = DynamixelDialect((1, 2))
    question = c.ReadStatus()
    frame = dialect.encode(1, question)
    first, second = each_packet(bench.bench.receive(frame))
    assert dialect.feed(first) == []
    assert dialect.again(question, frame) == frame
    assert dialect.feed(second) == []
    assert len(dialect.feed(first)) == 1


def test_servos_stop_by_themselves_when_their_host_is_gone(controller: Controller, bench: VirtualBench) -> None:
    controller.set_points({1: 3000})
    bench.sleep_until(bench.now() + 0.45)
    bench.sleep_until(bench.now() + 0.3)
    held = positions(bench)
    bench.sleep_until(bench.now() + 1.0)
    assert positions(bench) == held
    assert c.StatusFlag.FROZEN in bench.controller().status().flags


def test_a_watch_lasts_from_set_points_to_the_connection_s_end(controller: Controller, bench: VirtualBench) -> None:
    bench.hearing = lambda data: without(data, Table.BUS_WATCHDOG)
    controller.set_points({1: 2100})
    bench.hearing = lambda data: data
    controller.set_points({1: 2105})
    assert [servo[Table.BUS_WATCHDOG] for servo in bench.bench.servos] == [25, 25]
    with bench.controller() as other:
        other.set_points({1: 2100})
    bench.sleep_until(bench.now() + 5.0)
    assert c.StatusFlag.FROZEN not in bench.controller().status().flags


def test_a_servo_off_the_bus_is_named_and_the_other_is_stopped(controller: Controller, bench: VirtualBench) -> None:
    controller.set_points({1: 2800, 2: 1700})
    bench.sleep_until(bench.now() + 0.1)
    bench.bench.gone.add(2)
    with pytest.raises(LinkTimeoutError, match=r"servo 2 \(joint 2\) does not answer, the others do"):
        controller.next_snapshot()
    stopped = controller.stop()
    assert not stopped.acknowledged
    assert "servo 2 (joint 2) does not answer" in (stopped.problem or "")
    first = bench.bench.servos[0]
    assert abs(first[Table.GOAL_POSITION] - first[Table.PRESENT_POSITION]) < 60
    assert first[Table.GOAL_POSITION] != 2800


def test_a_hardware_error_is_one_line_that_names_servo_and_error(controller: Controller, bench: VirtualBench) -> None:
    controller.set_points({1: 2100})
    bench.bench.fail(2, HardwareError.OVERHEATING)
    with pytest.raises(HardwareFaultError, match="servo 2 reports overheating: its joint may be without torque"):
        controller.next_snapshot()
    with pytest.raises(RequestRefusedError, match="servo 2 reports overheating; when its cause is gone"):
        controller.release(controller.status().stop)


def test_a_hardware_error_and_a_lost_supply_are_one_line(controller: Controller, bench: VirtualBench) -> None:
    controller.set_points({1: 2100})
    bench.bench.reboot(1)
    with pytest.raises(ControllerRestartedError, match="the controller has restarted"):
        controller.next_snapshot()
    with pytest.raises(
        ProtocolError, match="SetGripper: Dynamixel servos are only read, moved, stopped and released from here"
    ):
        controller.set_gripper(closed=True)


def test_a_clock_that_stands_still_is_not_believed(controller: Controller, bench: VirtualBench) -> None:
    block = bench.bench.receive(encode(ask.sync_read((1, 2), 64, 72)))
    bench.saying = lambda _data: block
    first = controller.next_snapshot()
    with pytest.raises(NoSampleError, match="the controller's clock stands still at"):
        controller.next_snapshot(first.tick + 19)


def test_a_sample_that_is_far_too_late_is_told_as_what_it_is(controller: Controller, bench: VirtualBench) -> None:
    first = controller.next_snapshot()
    second = controller.next_snapshot(first.tick + 19)
    bench.sleep_until(bench.now() + 0.05)
    third = controller.next_snapshot(second.tick + 19)
    assert 50 <= third.tick - second.tick <= 52
    assert third.missing_before == 2


def test_one_servo_whose_clock_stands_still_is_not_believed(controller: Controller, bench: VirtualBench) -> None:
    first = controller.next_snapshot()
    old: list[bytes] = []

    def second_repeats_itself(data: bytes) -> bytes:
        packets = each_packet(data)
        old.extend(packets[1:2])
        return b"".join([*packets[:1], *old[:1]])

    bench.saying = second_repeats_itself
    first = controller.next_snapshot(first.tick + 19)
    with pytest.raises(NoSampleError, match="the controller's clock stands still at"):
        controller.next_snapshot(first.tick + 19)


def test_a_late_answer_takes_no_time_back_and_gives_none(bench: VirtualBench) -> None:
    dialect = DynamixelDialect((1, 2))

    def told(at_s: float) -> bytes:
        bench.sleep_until(at_s)
        return bench.bench.receive(encode(ask.sync_read((1, 2), 64, 72)))

    def tick(sequence: int, block: bytes) -> int:
        dialect.encode(sequence, c.ReadStatus())
        ((_, status),) = dialect.feed(block)
        assert isinstance(status, c.Status)
        return status.tick

    early, later, last = told(1.0), told(1.1), told(1.2)
    assert [tick(1, early), tick(2, later), tick(3, early), tick(4, last)] == [0, 100, 100, 200]


def test_clocks_are_believed_again_after_a_long_pause(controller: Controller, bench: VirtualBench) -> None:
    tick = controller.next_snapshot().tick
    bench.sleep_until(bench.now() + 20.0)
    ticks = [controller.next_snapshot(tick).tick for _ in range(2)]
    assert tick < ticks[0]


def test_a_set_point_beyond_a_servos_own_limits_is_refused_before_it_is_sent(bench: VirtualBench) -> None:
    limited = VirtualBench(Options(torque=False))
    limited.bench.servos[1].write(Table.MIN_POSITION_LIMIT.address, (1000).to_bytes(4, "little"))
    controller = limited.controller()
    controller.release(controller.status().stop)
    with pytest.raises(ProtocolError, match="joint 2: set point of 900 counts: servo 2 itself allows 1000 to 4095"):
        controller.set_points({2: 900})
    assert controller.next_snapshot()[2].set_point > 1000


def test_a_servo_that_drives_otherwise_is_not_driven() -> None:
    bench = VirtualBench(Options(torque=False))
    bench.bench.servos[1].write(Table.OPERATING_MODE.address, b"\1")
    with pytest.raises(RequestRefusedError, match=r"servo 2 is in operating mode 1, position control \(3\) is needed"):
        bench.controller()
    bench = VirtualBench(Options(torque=False))
    servo = bench.bench.servos[1]
    servo.write(Table.DRIVE_MODE.address, b"\x08")
    with pytest.raises(RequestRefusedError, match="servo 2 has Torque On by Goal Update"):
        bench.controller()
    assert not servo.torque
    servo.write(Table.GOAL_POSITION.address, (2000).to_bytes(4, "little"))
    assert servo.torque


def test_lost_and_damaged_packets_are_made_good_by_asking_again(controller: Controller, bench: VirtualBench) -> None:
    turn = iter(range(10**6))
    bench.hearing = lambda data: b"" if next(turn) % 7 == 3 else data
    bench.saying = lambda data: data[:-3] if next(turn) % 9 == 4 else data
    tick = controller.next_snapshot().tick
    for step in range(40):
        snapshot = controller.next_snapshot(tick + 19, set_points={1: 2060 + step})
        tick = snapshot.tick
        assert snapshot.set_points[1] == 2060 + step
    assert controller.stop().acknowledged
    assert controller.counters.retries > 0


def test_an_adapter_that_returns_our_own_bytes_disturbs_nothing(controller: Controller, bench: VirtualBench) -> None:
    own: list[bytes] = []
    bench.hearing = lambda data: own.append(data) or data  # type: ignore[func-returns-value]
    bench.saying = lambda data: own.pop() + data
    controller.set_points({1: 2100})
    assert controller.next_snapshot().set_points[1] == 2100
