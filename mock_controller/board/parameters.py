"""The board's constants, read from a data file that states the source of each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import resources

from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import GAIN_MAX, JointCalibration
from mock_controller.quantities import DataFileError, Provenance, QuantityReader


@dataclass(frozen=True)
class BoardTiming:
    """Times of the controller, in µs.

    A period begins with sampling. For `fetch_window` the board then reads set points and gains from the shared memory.
    After `computing_delay` the drive changes and the values are published, one byte per `publish_byte`.
    `host_byte`: time for which the host holds the memory per byte. `reset`: duration of a brown-out.
    """

    period: int
    computing_delay: int
    fetch_window: int
    publish_byte: int
    host_byte: int
    reset: int


@dataclass(frozen=True)
class BoardParameters:
    """All constants of the board. Element i of the tuples is joint i+1.

    `linearity` is the potentiometers' largest error as a fraction of the range, `noise` the converter's rms in counts
    before rounding, `dac_full_scale` the volts of 127 DAC counts, `default_gains` (P, I, D) those in EPROM.
    `controller_scales` multiply the controllers' outputs before their limit; at 1 a gain has its stated meaning.
    """

    timing: BoardTiming
    linearity: float
    noise: float
    dac_full_scale: float
    integral_shift: int
    default_gains: tuple[tuple[int, int, int], ...]
    calibrations: tuple[JointCalibration, ...]
    controller_scales: tuple[float, ...] = (1.0,) * JOINTS


def parse_board(text: str, origin: str = "board file") -> tuple[BoardParameters, tuple[Provenance, ...]]:
    """Returns parameters and the source of each, from TOML text. Raises DataFileError with one clear line."""
    reader = QuantityReader(text, origin)

    def micros(key: str, low: int, high: int) -> int:
        return reader.take_int("timing", key, "us", low, high)

    timing = BoardTiming(
        period=micros("period", 1000, 1_000_000),
        computing_delay=micros("computing_delay", 0, 1_000_000),
        fetch_window=micros("fetch_window", 1, 100_000),
        publish_byte=micros("publish_byte", 1, 1000),
        host_byte=micros("host_byte", 1, 1000),
        reset=micros("reset", 0, 10_000_000),
    )
    busy = max(timing.computing_delay, timing.fetch_window) + 6 * JOINTS * timing.publish_byte
    if busy >= timing.period:
        raise DataFileError(f"{origin}: timing: the work of {busy} us does not fit a period of {timing.period} us")
    gains = tuple(reader.take_int("controller", f"default_{key}", "gain", 0, GAIN_MAX) for key in "pid")
    parameters = BoardParameters(
        timing=timing,
        linearity=reader.take("converter", "linearity", "1", 0, 0.1),
        noise=reader.take("converter", "noise", "count", 0, 100),
        dac_full_scale=reader.take("converter", "dac_full_scale", "V", 1e-3, 100),
        integral_shift=reader.take_int("controller", "integral_shift", "bit", 0, 16),
        default_gains=((gains[0], gains[1], gains[2]),) * JOINTS,
        calibrations=tuple(_calibration(reader, joint) for joint in range(1, JOINTS + 1)),
    )
    reader.finish()
    return parameters, tuple(reader.provenance)


def _calibration(reader: QuantityReader, joint: int) -> JointCalibration:
    table = f"joint_{joint}"
    direction = reader.take_int(table, "direction", "1", -1, 1)
    if direction == 0:
        raise DataFileError(f"{table}.direction: value is 0, allowed are 1 and -1")
    return JointCalibration(
        joint=joint,
        range_rad=math.radians(reader.take(table, "range", "deg", 1, 720)),
        angle_at_zero_rad=math.radians(reader.take(table, "angle_at_zero", "deg", -720, 720)),
        direction=direction,
    )


def default_board_text() -> str:
    """Returns the text of the shipped data file."""
    return resources.files("mock_controller.board").joinpath("ma2000_board.toml").read_text("utf-8")


def default_board() -> BoardParameters:
    """Returns parameters of the shipped data file."""
    return parse_board(default_board_text(), "ma2000_board.toml")[0]
