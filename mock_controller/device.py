"""Builds one mock: arm, board, faults, bridge and link."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random, SystemRandom
from typing import Any

from firmware_protocol.errors import MemoryMapError
from firmware_protocol.memory_map import MemoryMap, default_memory_map, parse_memory_map
from mock_controller.board.board import Board
from mock_controller.board.parameters import BoardParameters, default_board, parse_board
from mock_controller.bridge.bridge import Bridge
from mock_controller.bridge.link import Link
from mock_controller.faults.fault import FaultyParts
from mock_controller.faults.fault_set import FaultSet
from mock_controller.modification import Modification
from mock_controller.modifications import ModificationError, build_modifications
from mock_controller.options import Options, OptionsError
from mock_controller.plant import Plant, PlantParameters, default_plant, parse_plant
from mock_controller.timeline import Timeline


@dataclass(frozen=True)
class Device:
    """The parts of one mock."""

    board: Board
    faults: FaultSet
    bridge: Bridge
    link: Link
    modifications: tuple[str, ...]
    keeps_secret: bool
    """Whether the true state of the arm is secret."""


def build_device(options: Options, disconnect: Callable[[float], None]) -> Device:
    """Builds arm, board and bridge from the options, at board time 0, with the faults switched on.

    `disconnect` cuts the line for a number of seconds. Raises ValueError with one clear line for invalid options.
    """
    parameters = _board_parameters(options)
    plant_parameters = _plant_parameters(options)
    arm_seed: int | None = None
    if options.secret is None:
        modifications = build_modifications(_modification(text) for text in options.modify)
    else:
        from mock_controller.hidden.arm import draw_arm

        arm = draw_arm(options.secret)
        arm_seed, modifications = arm.seed, arm.modifications()
        parameters, plant_parameters = arm.board_parameters(parameters), arm.plant_parameters(plant_parameters)
    if options.secret_sensors is not None:
        from mock_controller.hidden.sensors import draw_sensors

        parameters = replace(parameters, calibrations=draw_sensors(options.secret_sensors, parameters.calibrations))
        arm_seed = options.secret_sensors if arm_seed is None else arm_seed
    if options.start is None:
        plant = Plant(plant_parameters, modifications)
    else:
        pairs = zip(parameters.calibrations, options.start, strict=True)
        plant = Plant(plant_parameters, modifications, [scale.posture_to_rad(posture) for scale, posture in pairs])
    board = _board(options, parameters, plant, modifications, arm_seed)
    faults = FaultSet(FaultyParts(board, disconnect), options.seed)
    bridge = Bridge(
        Timeline(board, faults),
        sees_period=options.sample,
        compact=options.compact,
        lock_step=options.lock_step,
        first_number=_first_number(options),
    )
    link = Link(bridge, faults, options.baud)
    for text in options.fault:
        faults.switch_on(text)
    return Device(board, faults, bridge, link, options.modify, options.secret is not None)


def _board(
    options: Options,
    parameters: BoardParameters,
    plant: Plant,
    modifications: tuple[Modification, ...],
    arm_seed: int | None,
) -> Board:
    """Returns the board; with a secret memory, `memory_map` is only the bridge's."""
    told = _memory_map(options)
    if options.secret_map is None:
        if told.absent:
            raise MemoryMapError(
                f"memory map {told.name!r}: without {', '.join(told.absent)} it is one for --secret-map; the mock's "
                "own controller needs every register"
            )
        return Board(parameters, told, plant, options.seed, modifications, arm_seed)
    from mock_controller.hidden.memory import SecretBoard, draw_memory

    secret = draw_memory(options.secret_map, options.documented)
    if options.gains is None:
        parameters = replace(parameters, default_gains=secret.gains)
    return SecretBoard(secret, parameters, secret.map, plant, options.seed, modifications, arm_seed, told_map=told)


def _first_number(options: Options) -> int:
    """Returns the first ID of sessions and stops: in lock-step from the seed, so that a run repeats exactly."""
    return (Random(f"bridge {options.seed}") if options.lock_step else SystemRandom()).getrandbits(32)


def _memory_map(options: Options) -> MemoryMap:
    path = options.memory_map
    return default_memory_map() if path is None else parse_memory_map(_text(path, "memory-map"), str(path))


def _plant_parameters(options: Options) -> PlantParameters:
    path = options.plant
    return default_plant() if path is None else parse_plant(_text(path, "plant"), str(path))[0]


def _board_parameters(options: Options) -> BoardParameters:
    path = options.board
    parameters = default_board() if path is None else parse_board(_text(path, "board"), str(path))[0]
    if options.gains is not None:
        parameters = replace(parameters, default_gains=(options.gains,) * len(parameters.default_gains))
    return parameters


def _text(path: Path, option: str) -> str:
    try:
        return path.read_text("utf-8-sig")
    except OSError as error:
        raise OptionsError(f"{option}: {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise OptionsError(f"{option}: {path}: not a text file in UTF-8") from None


def _modification(text: str) -> tuple[str, dict[str, object]]:
    name, _, rest = text.partition(":")
    values: dict[str, object] = {}
    for item in filter(None, (part.strip() for part in rest.split(","))):
        key, equals, value = (part.strip() for part in item.partition("="))
        if not equals:
            raise ModificationError(f"modification {name}: {item!r}: write parameter=value")
        values[key] = _number(value)
    return name.strip(), values


def _number(text: str) -> Any:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
