"""The motor controller: a 6502 with a control period, a memory shared with the host, and an arm on its amplifiers.

Time is the board's own, in whole µs, and moves only by `run_until` and by the accesses of the host, which take time.
A period is three events:
    start     positions are sampled; set points and gains are fetched, unless the host holds the memory at this very
              moment: the controller does not wait (section 6.3), goes on with those it had, and counts it
    output    a computing delay later the drive changes and the results are stored, byte by byte
    complete  the last byte is stored and the period's snapshot joins the ring
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from firmware_protocol.memory_map import JOINTS, MemoryMap
from firmware_protocol.units import DAC_MAX, GAIN_MAX, POSTURE_UNITS, counts_to_posture, posture_to_counts
from mock_controller.board.extension_points import ChangesBoard, ChangesSetPoint
from mock_controller.board.hand import Hand
from mock_controller.board.memory import SharedMemory
from mock_controller.board.parameters import BoardParameters
from mock_controller.board.pid import IntegerPid
from mock_controller.board.sensor import PositionSensors
from mock_controller.board.snapshot import PeriodSnapshot, SnapshotRing
from mock_controller.modification import Modification, of_kind
from mock_controller.plant import Plant


class BoardError(ValueError):
    """An invalid request to the board."""


@dataclass
class BoardCounters:
    """Counts since the mock was started; a brown-out does not clear them."""

    boots: int = 0
    periods: int = 0
    set_points_missed: int = 0
    """Periods in which the host held the memory when the controller wanted it."""
    set_points_invalid: int = 0
    """Set points above 999 in the memory, which the controller ignored."""
    gains_invalid: int = 0
    """Gains above 20 in the memory, which the controller ignored."""
    writes_while_frozen: int = 0
    """Bytes for set points that the freeze blocked."""


class Board:
    """Controller and arm, switched on at time 0 with the arm where `plant` has it.

    `arm_seed` draws properties of this one arm, its potentiometers' curves; without it `seed` draws them. `told_map` is
    the memory map that the host's side assumes; without it, the true one.

    Raises BoardError if the plant's step does not divide the period and the computing delay.
    """

    def __init__(
        self,
        parameters: BoardParameters,
        memory_map: MemoryMap,
        plant: Plant,
        seed: int,
        modifications: Iterable[Modification] = (),
        arm_seed: int | None = None,
        told_map: MemoryMap | None = None,
    ) -> None:
        modifications = tuple(modifications)
        for change in of_kind(modifications, ChangesBoard):
            parameters = change.change_board(parameters)
        self.parameters = parameters
        self.plant = plant
        self.memory = SharedMemory(memory_map)
        self.host_memory = self.memory if told_map is None else self.memory.seen_through(told_map)
        """The memory as the host's side understands it."""
        self.written: Counter[int] = Counter()
        """How often the host has written to each address."""
        self.hand = Hand()
        self.sensors = PositionSensors(parameters, seed, modifications, arm_seed)
        self.snapshots = SnapshotRing()
        self.counters = BoardCounters()
        self._timing = parameters.timing
        for name, value in (("period", self._timing.period), ("computing_delay", self._timing.computing_delay)):
            if value % plant.step_us:
                raise BoardError(f"{name} of {value} µs: must be a multiple of the plant's step, {plant.step_us} µs")
        self._set_point_effects: list[ChangesSetPoint] = of_kind(modifications, ChangesSetPoint)
        self._pids = [IntegerPid(parameters.integral_shift, scale) for scale in parameters.controller_scales]
        self._volts_per_count = [
            calibration.direction * parameters.dac_full_scale / DAC_MAX for calibration in parameters.calibrations
        ]
        self._set_point_addresses = frozenset(self.host_memory.map["set_point"].addresses)
        self._time_us = 0
        self._complete_us = 0
        self._frozen = False
        self._postureless = False
        self._process_inputs = 0
        self._host_until_us = 0
        self._published: list[tuple[int, int]] = []
        self._power_up()

    # --- time

    @property
    def time_us(self) -> int:
        """The board's time (µs) since it was first switched on."""
        return self._time_us

    @property
    def next_event_us(self) -> int:
        """Time (µs) of the controller's next event."""
        return self._next_us

    @property
    def next_snapshot_us(self) -> int:
        """Earliest time (µs) at which another snapshot may be complete."""
        return max(self._next_us, self._complete_us)

    def run_until(self, time_us: int) -> None:
        """Advances time up to and including `time_us`. A past time changes nothing."""
        while self._next_us <= time_us:
            self._time_us = self._next_us
            self._next_action()
        self._time_us = max(self._time_us, time_us)

    # --- the host's side of the memory

    def read(self, address: int, count: int) -> bytes:
        """Returns `count` bytes from `address`, read one after the other; takes time. Raises MemoryAddressError."""
        self.memory.check(address, count)
        self._take_memory(count)
        end_us = self._host_until_us
        if self._stored == len(self._published) and end_us < self._next_us:  # nothing changes meanwhile
            self.run_until(end_us)
            return self.memory.block(address, count)
        data = bytearray()
        for left in range(count - 1, -1, -1):
            self.run_until(end_us - left * self._timing.host_byte)
            self._store_published()
            data.append(self.memory.get(address + len(data)))
        return bytes(data)

    def write(self, address: int, data: bytes) -> None:
        """Writes bytes from `address` on, in one access; takes time. Raises MemoryAddressError."""
        self.memory.check(address, len(data))
        self._write_pairs([(address + offset, value) for offset, value in enumerate(data)])

    def write_set_points(self, postures: Mapping[int, int]) -> None:
        """Writes set points (posture units 0–999) of joints (from 1) in one access; takes time. Ignored while
        frozen."""
        for joint, posture in postures.items():
            if not (1 <= joint <= JOINTS and 0 <= posture < POSTURE_UNITS):
                limit = POSTURE_UNITS - 1
                raise BoardError(f"joint {joint}: set point of {posture}: joints 1 to {JOINTS}, values 0 to {limit}")
        by_index = [(joint - 1, posture) for joint, posture in postures.items()]
        self._write_pairs(self.host_memory.encoded("set_point", by_index))

    def hold_memory(self, duration_us: int) -> None:
        """Keeps the memory busy on the host's side for `duration_us` from now: every fetch in that time is missed."""
        self._host_until_us = max(self._host_until_us, self._time_us + duration_us)

    # --- stop

    @property
    def frozen(self) -> bool:
        """Whether set points are held since a `freeze`."""
        return self._frozen

    def hold(self) -> None:
        """Blocks new set points from now on; a `freeze` with a posture follows."""
        self._frozen, self._postureless = True, True

    def freeze(self, positions: Sequence[int] | None = None) -> tuple[int, ...]:
        """Makes the measured posture the set points, held until `release`; returns the six postures (posture units).

        A second freeze changes nothing. The latch survives a brown-out. positions: measured positions (ADC counts) as
        the host's side has read them; None for the board's own
        """
        if self._frozen and self._powered and not self._postureless:
            return tuple(self.host_memory.values("set_point"))
        self._frozen, self._postureless = True, False
        postures = tuple(counts_to_posture(counts) for counts in positions or self._measured)
        self._write_pairs(self.host_memory.encoded("set_point", enumerate(postures)), by_freeze=True)
        return postures

    def release(self) -> None:
        """Ends the freeze; set points stay until new ones are written."""
        self._frozen = False

    # --- the rest of the panel

    @property
    def tick(self) -> int:
        """Periods begun since power-up; the first is 1."""
        return self._tick

    @property
    def powered(self) -> bool:
        """False during a brown-out."""
        return self._powered

    @property
    def process_outputs(self) -> int:
        """Bits at the output ports."""
        return self._process_outputs

    @property
    def gripper_closed(self) -> bool:
        """Whether the gripper's valve is on."""
        return self._gripper_closed

    def set_process_inputs(self, bits: int) -> None:
        """Sets the input ports to bits (0–255); the memory shows them from the next period on."""
        if not 0 <= bits <= 0xFF:
            raise BoardError(f"process inputs {bits}: allowed are 0 to 255")
        self._process_inputs = bits

    def press_emergency_stop(self, pressed: bool) -> None:
        """Cuts the drives' power, and a person's hand then holds the arm; when released, the drives hold it again.

        The controller itself stays switched on.
        """
        self._advance_plant(self._now_on_step())
        if pressed:
            self.hand.take(self.plant.joint_angles)
        else:
            self.hand.let_go()

    def lead(self, angles: Mapping[int, float], seconds: float) -> None:
        """Moves joints (from 1) by hand to angles (rad) within `seconds`.

        Raises BoardError while the drives have power, and for an angle beyond an end stop.
        """
        if not self.hand.has_arm:
            raise BoardError("the drives have power: press the emergency stop before moving the arm by hand")
        for joint, angle in angles.items():
            stops = self.plant.parameters.joints[joint - 1]
            if not stops.lower_stop <= angle <= stops.upper_stop:
                raise BoardError(f"joint {joint}: {angle:.3f} rad is beyond an end stop")
        now = self._now_on_step()
        self._advance_plant(now)
        self.hand.lead({joint - 1: angle for joint, angle in angles.items()}, now, round(seconds * 1e6))

    def end_stop(self, joint: int, *, high: bool) -> float:
        """Returns the angle (rad) of an end stop of a joint (from 1)."""
        stops = self.plant.parameters.joints[joint - 1]
        return stops.upper_stop if high else stops.lower_stop

    def _now_on_step(self) -> int:
        """Returns the present, rounded up to a step of the plant (µs)."""
        step = self.plant.step_us
        return -(-self._time_us // step) * step

    def brown_out(self) -> None:
        """Interrupts the supply: drive off, memory lost; after the reset time the controller powers up again.

        Until then the memory reads as zero. Ticks start again at 1.
        """
        off_us = self._now_on_step()
        self._advance_plant(off_us)
        self._volts = [0.0] * JOINTS
        self._powered = False
        self._complete_us = 0
        self._published = []
        self._stored = 0
        self.memory.clear()
        self._schedule(off_us + self._timing.reset, self._power_up)

    # --- the controller's program

    def _schedule(self, time_us: int, action: Callable[[], None]) -> None:
        self._next_us = time_us
        self._next_action = action

    def _power_up(self) -> None:
        """Makes the measured posture the set points, so that nothing jumps; reads gains from EPROM."""
        self._advance_plant(self._time_us)
        self.counters.boots += 1
        self.memory.clear()
        self.snapshots.clear()
        self._powered = True
        self._tick = 0
        self._volts = [0.0] * JOINTS
        self._period_start_us = self._time_us - self._timing.period
        self._published = []
        self._stored = 0
        self._process_outputs = 0
        self._gripper_closed = False
        for pid in self._pids:
            pid.reset()
        self._gains = list(self.parameters.default_gains)
        self._measured = self.sensors.read(self.plant.joint_angles)
        self._postures = [counts_to_posture(counts) for counts in self._measured]
        self.memory.store("set_point", self._postures)
        self.memory.store("position", self._measured)
        for column, name in enumerate(("gain_p", "gain_i", "gain_d")):
            self.memory.store(name, [gains[column] for gains in self._gains])
        self._schedule(self._time_us, self._start_period)

    def _start_period(self) -> None:
        now = self._time_us
        self._advance_plant(now)
        self._tick += 1
        self._period_start_us = now
        self.counters.periods += 1
        self._measured = self.sensors.read(self.plant.joint_angles)
        missed = now < self._host_until_us
        if missed:
            self.counters.set_points_missed += 1
        else:
            self._fetch()
        results = self._control(missed)
        self._schedule(now + self._timing.computing_delay, partial(self._change_output, results))

    def _fetch(self) -> None:
        """Reads set points, gains and outputs from the memory; ignores those out of range."""
        for index, posture in enumerate(self.memory.values("set_point")):
            if posture < POSTURE_UNITS:
                self._postures[index] = posture
            else:
                self.counters.set_points_invalid += 1
        columns = (self.memory.values(name) for name in ("gain_p", "gain_i", "gain_d"))
        for index, gains in enumerate(zip(*columns, strict=True)):
            if max(gains) <= GAIN_MAX:
                self._gains[index] = gains
            else:
                self.counters.gains_invalid += 1
        self.memory.store("process_inputs", [self._process_inputs])
        self._process_outputs = self.memory.values("process_outputs")[0]
        self._gripper_closed = bool(self.memory.values("gripper")[0])

    def _control(self, missed: bool) -> PeriodSnapshot:
        targets = [posture_to_counts(posture) for posture in self._postures]
        for effect in self._set_point_effects:
            index = effect.joint - 1
            targets[index] = effect.set_point(targets[index], self._tick)
        errors = [target - position for target, position in zip(targets, self._measured, strict=True)]
        powers = [pid.update(e, gains) for pid, e, gains in zip(self._pids, errors, self._gains, strict=True)]
        return PeriodSnapshot(
            tick=self._tick,
            time_us=self._time_us,
            set_points=tuple(self._postures),
            positions=self._measured,
            errors=tuple(errors),
            powers=tuple(powers),
            set_point_missed=missed,
            frozen=self._frozen,
        )

    def _change_output(self, results: PeriodSnapshot) -> None:
        """Applies the new drive after the computing delay, and begins to store the results in the memory."""
        now = self._time_us
        self._advance_plant(now)
        self._volts = [scale * power for scale, power in zip(self._volts_per_count, results.powers, strict=True)]
        self._published = self._to_publish(results)
        self._stored = 0
        self._publishing_since_us = now
        self._complete_us = now + len(self._published) * self._timing.publish_byte
        self._schedule(self._complete_us, partial(self._complete_period, results))

    def _to_publish(self, results: PeriodSnapshot) -> list[tuple[int, int]]:
        """Returns (address, byte) pairs of a period's results, in the order in which they are stored."""
        encoded = self.memory.encoded
        return [
            *encoded("position", enumerate(results.positions)),
            *encoded("error", enumerate(results.errors)),
            *encoded("power", enumerate(results.powers)),
        ]

    def _complete_period(self, results: PeriodSnapshot) -> None:
        self._store_published()
        self._complete_us += self._timing.period
        self.snapshots.append(results if self.host_memory is self.memory else self._as_host_sees(results))
        self._schedule(self._period_start_us + self._timing.period, self._start_period)

    def _as_host_sees(self, results: PeriodSnapshot) -> PeriodSnapshot:
        """Returns the results as a host with another memory map decodes them."""
        set_points, positions, errors, powers = (
            tuple(self.host_memory.values(name)) for name in ("set_point", "position", "error", "power")
        )
        return replace(results, set_points=set_points, positions=positions, errors=errors, powers=powers)

    def _store_published(self) -> None:
        """Updates the memory to the present: byte k of the results is there k+1 byte times after their start."""
        total = len(self._published)
        if self._stored == total:
            return
        due = min((self._time_us - self._publishing_since_us) // self._timing.publish_byte, total)
        self.memory.put_all(self._published[self._stored : due])
        self._stored = due

    def _advance_plant(self, time_us: int) -> None:
        behind = time_us - self.plant.time_us
        if behind <= 0:
            return
        if self.hand.has_arm:
            self.plant.place(self.hand.angles(time_us), behind)
        else:
            self.plant.advance(self._volts, behind)

    # --- contention

    def _take_memory(self, count: int) -> None:
        """Begins an access of `count` bytes; in the controller's fetch window the host must wait for its end."""
        self.run_until(self._period_start_us + self._timing.fetch_window)
        self._host_until_us = self._time_us + count * self._timing.host_byte

    def _write_pairs(self, pairs: Sequence[tuple[int, int]], by_freeze: bool = False) -> None:
        self._take_memory(len(pairs))
        end_us = self._host_until_us
        self.written.update([address for address, _ in pairs] if not by_freeze else ())
        if self._stored == len(self._published) and end_us < self._next_us and self._powered and not self._frozen:
            self.run_until(end_us)  # nothing else happens meanwhile
            self.memory.put_all(pairs)
            return
        for left, (address, value) in zip(range(len(pairs) - 1, -1, -1), pairs, strict=True):
            self.run_until(end_us - left * self._timing.host_byte)
            self._store_published()
            if self._frozen and not by_freeze and address in self._set_point_addresses:
                self.counters.writes_while_frozen += 1
            elif self._powered:
                self.memory.put(address, value)
