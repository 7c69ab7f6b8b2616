"""Watching the memory, copying files that ship, and a commissioning that goes on where it was ended."""

import json
import os
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import pytest
import typer

from daq.config.machine_text import machine_text
from daq.contracts.errors import SafetyError, SpecError
from daq.contracts.machine import BoardPid, load_machine, parse_machine
from daq.contracts.quantity import Quantity
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from extras.commissioning.command.bench import Bench, Commissioner
from extras.commissioning.command.by_hand import potentiometers
from extras.commissioning.command.measured import with_controller, with_limits, with_sensors
from extras.commissioning.command.periods import Periods
from extras.commissioning.command.record import Record
from extras.commissioning.command.sheet import acceptance_sheet, addresses_of
from extras.commissioning.command.steps import STEPS, lacking, resting_on, step_named
from extras.commissioning.memory.procedure import Task, is_alive, release, switched_off_and_on
from extras.commissioning.person.memory_page import open_page
from extras.commissioning.person.pressed import KEEP_PRESSED, EmergencyStop
from extras.commissioning.person.terminal_operator import Lines, TerminalOperator, words
from extras.commissioning.potentiometer import Interval, Potentiometer
from firmware_protocol.commands import ReadStatus, Status, StatusFlag, Stop, Stopped
from firmware_protocol.memory_map import default_memory_map
from model.blocks import Text
from tests.daq_cli.invoke import CommandLine

MOCK = "mock://?lock_step=1&seed=3"


def test_the_watched_memory_shows_what_changes_and_what_changes_with_it(daq: CommandLine) -> None:
    said = daq("--port", MOCK + "&secret_map=5", "memory", "watch", "--json", "--seconds", "0.4")
    found = json.loads(said.out)
    assert said.code == 0
    assert found["bytes"][0]["address"] == "FC00"
    assert len(found["bytes"]) == default_memory_map().size
    changing = [one for one in found["bytes"] if one["changes"]]
    assert changing
    assert any(one["together"] for one in changing)
    assert all(one["lowest"] <= one["value"] <= one["highest"] for one in found["bytes"])


def test_a_byte_of_which_nothing_is_proved_is_not_written() -> None:
    with open_page(MOCK, default_memory_map()) as page:
        before = page.read_byte(0xFC00)
        with pytest.raises(SafetyError, match="FC00"):
            page.write_byte(0xFC00, before)
        page.prove([0xFC00])
        page.write_byte(0xFC00, before)
        with pytest.raises(SafetyError, match="FC01"):
            page.write_byte(0xFC01, 0)


def test_a_step_is_kept_at_once_and_not_done_again(daq: CommandLine, tmp_path: Path) -> None:
    daq("config", "copy", "memory-map", "-o", tmp_path / "memory_map.toml")
    skipped = [word for step in STEPS[1:] for word in ("--skip", step.name)]
    said = daq("--port", MOCK, "commission", "--folder", tmp_path, *skipped)
    assert said.code == 0
    record = tomllib.loads((tmp_path / "commissioning.toml").read_text("utf-8"))["step"]
    assert record["line"]["capabilities"] == ["sample", "lock_step", "simulated", "compact"]
    assert record["memory"]["skipped"]
    page = (tmp_path / "acceptance.html").read_text("utf-8")
    assert f"1 of {len(STEPS)} steps are done, {len(STEPS) - 1} are left out, 0 are open." in page
    assert page.count("Left out on ") == len(STEPS) - 1
    assert tomllib.loads((tmp_path / "daq.toml").read_text("utf-8"))["robot"]["port"] == MOCK
    done = record["line"]["done"]
    assert daq("--port", MOCK, "commission", "--folder", tmp_path).code == 0
    again = tomllib.loads((tmp_path / "commissioning.toml").read_text("utf-8"))["step"]
    assert again["line"]["done"] == done


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--only", "dance"), "step 'dance': there are line, memory"),
        (("--folder", "nowhere"), "make it first"),
        (("--skip", "memory"), "--skip memory"),  # nothing relies on an assumed memory map
        (("--only", "model"), "first do ramp"),
        (("--only", "line", "--skip", "line"), "nothing would be done"),
    ],
)
def test_what_cannot_be_done_is_one_line(daq: CommandLine, options: tuple[str, ...], says: str) -> None:
    daq("--port", MOCK, "commission", *options).complains(2, says)


def test_a_step_that_was_left_out_is_counted_apart_and_shows_its_reason_in_place_of_a_table(
    daq: CommandLine, tmp_path: Path
) -> None:
    options = [word for step in STEPS for word in ("--skip", step.name)]
    daq("config", "copy", "memory-map", "-o", tmp_path / "memory_map.toml")
    why = "the arm is on loan"
    assert daq("--port", MOCK, "commission", "--folder", tmp_path, "--because", why, *options).code == 0
    sheet = acceptance_sheet(Record.of(tmp_path))
    assert sheet.answer.startswith(
        f"0 of {(n := len(STEPS))} steps are done, {n} are left out, 0 are open. Left out: Port and line, "
    )
    blocks = [block for section in sheet.sections[:-1] for block in section.blocks]
    assert len(blocks) == len(STEPS)
    assert all(isinstance(block, Text) and why in block.text for block in blocks)
    daq("--port", MOCK, "commission", "--folder", tmp_path, "--because", why).complains(2, "it needs --skip")


def test_limits_are_made_narrower_by_end_stops_and_never_wider() -> None:
    machine = load_machine("ma2000")
    before = machine.limits
    limits = with_limits(machine, {1: (1.0, 9.0), 3: (-9.0, 2.0)}).limits
    assert (limits.joint(1).low, limits.joint(1).high) == (1.0, before.joint(1).high)
    assert (limits.joint(3).low, limits.joint(3).high) == (before.joint(3).low, 2.0)
    assert limits.joint(2) == before.joint(2)
    assert limits.floor_height == before.floor_height


def test_what_was_measured_of_the_controller_stands_in_the_machine_file_once() -> None:
    machine = load_machine("ma2000")
    gain = Quantity(value=0.9, unit="1", source="measured", deviation=0.01)
    for _ in range(2):
        machine = with_controller(machine, {"dac_counts_per_adc_count": gain, "gains": ((3, 0, 0),) * 6})
    text = machine_text(machine)
    controller = parse_machine(text).controller
    assert isinstance(controller, BoardPid)
    assert controller.dac_counts_per_adc_count.value == 0.9
    assert not controller.dac_counts_per_adc_count.assumed
    assert controller.gains == ((3, 0, 0),) * 6
    assert text.count("dac_counts_per_adc_count = ") == 1


def test_measured_sensors_stand_in_the_machine_file() -> None:
    sensor = Potentiometer(2, -1, Interval(0.5, 0.01), Interval(4.7, 0.02), Interval(0.0, 0.0), 0.0, (), (), ())
    machine = parse_machine(machine_text(with_sensors(load_machine("ma2000"), [sensor])))
    found, untouched = machine.joint(2).sensor, machine.joint(1).sensor
    assert found is not None
    assert (found.direction, found.range.value, found.at_zero.value) == (-1, 4.7, 0.5)
    assert untouched == load_machine("ma2000").joint(1).sensor


@dataclass
class Hand:
    """A person who does `times` of each task, and nothing of it."""

    times: int = 1000
    tasks: list[str] = field(default_factory=list)
    told: list[str] = field(default_factory=list)

    def begin(self, task: Task) -> bool:
        self.tasks.append(task.kind)
        return len(self.tasks) <= self.times

    def finished(self) -> bool:
        return True

    def show(self, text: str) -> None:
        self.told.append(text)

    def watch(self, postures: Mapping[int, int]) -> None:
        """Nobody looks."""


def operator(lines: list[str]) -> TerminalOperator:
    answers: Iterator[str] = iter(lines)
    return TerminalOperator(lambda: next(answers, ""))


def test_a_person_begins_skips_or_ends_each_task_and_nothing_but_enter_s_and_q_is_an_answer() -> None:
    person = operator(["\n", "s\n", "q\n"])
    assert person.begin(Task("rest"))
    assert not person.begin(Task("lead", joint=2))
    with pytest.raises(typer.Abort):
        person.begin(Task("switch_off_and_on"))
    for lines in ([], ["what?\n", "q\n"]):  # the input has ended
        with pytest.raises(typer.Abort):
            operator(lines).begin(Task("rest"))
    person = operator(["no\n", "\n", "no\n", "\n"])
    assert person.begin(Task("switch_off_and_on"))
    assert not person.finished(), "no is not: it is finished"
    assert person.finished()


def test_leaving_while_the_emergency_stop_is_pressed_says_so_and_a_resume_begins_with_the_safe_release(
    tmp_path: Path,
) -> None:
    record, hand = Record.of(tmp_path), Hand()
    stop = EmergencyStop(hand, record.note_stop)
    stop.tell(True)
    for raised in (KeyboardInterrupt, typer.Abort, SpecError):
        with pytest.raises(raised), stop:
            raise raised
    assert hand.told == [KEEP_PRESSED] * 3
    assert Record.of(tmp_path).stop_pressed
    with EmergencyStop(hand, record.note_stop) as stop:
        stop.tell(True)
        stop.tell(False)
    assert len(hand.told) == 3
    assert not Record.of(tmp_path).stop_pressed


def test_the_errors_are_read_again_after_the_prompt_and_while_the_emergency_stop_is_released() -> None:
    with open_page(MOCK, default_memory_map()) as page:
        for clean, tasks in ((0, 0), (1, 1), (2, 2)):
            hand, reasons = Hand(), iter([""] * clean + ["joint 2 would jump"])
            assert "joint 2 would jump" in release(page, hand, lambda reasons=reasons: next(reasons))
            assert hand.tasks == ["hold_for_release", "release_emergency_stop"][:tasks]
        assert release(page, Hand(), lambda: "") == ""


def test_a_stop_that_is_in_force_is_released_only_with_the_persons_word() -> None:
    with open_page(MOCK, default_memory_map()) as page:
        assert page.release_freeze(lambda: False), "nothing is in force, so nobody is asked"
        page.link.request(Stop(), Stopped)
        assert not page.release_freeze(lambda: False)
        assert page.link.request(ReadStatus(), Status).status & StatusFlag.FROZEN
        assert page.release_freeze(lambda: True)
        assert not page.link.request(ReadStatus(), Status).status & StatusFlag.FROZEN


def test_a_controller_that_was_not_seen_without_supply_is_to_be_switched_off_again() -> None:
    with open_page(MOCK, default_memory_map()) as page:
        hand = Hand(times=2)
        assert not switched_off_and_on(page, hand)
        assert hand.tasks == ["switch_off_and_on"] * 3


@pytest.mark.parametrize(("lines", "begins"), [(["\n"], True), (["banana\n", "\n"], True), (["s\n"], False)])
def test_a_step_at_the_arm_is_asked_for_even_with_yes(lines: list[str], begins: bool) -> None:
    assert operator(lines).may_begin(at_the_arm=True, yes=True) is begins
    for leaves in (["q\n"], []):
        with pytest.raises(typer.Abort):
            operator(leaves).may_begin(at_the_arm=True, yes=True)
    assert {one.name for one in STEPS if not one.at_the_arm} == {"line", "bridge", "period", "model"}


def test_the_steps_that_move_need_the_bridge_and_go_when_it_is_done_again(tmp_path: Path) -> None:
    record = Record.of(tmp_path)
    moving = {"stop", "delay", "gain", "first_ramp", "ramp"}
    for step in STEPS[1:]:
        record.keep(step.name, {"skipped": True})
    assert all("bridge" in lacking(step_named(name), record) for name in moving)
    record.keep("bridge", {})
    record.keep("period", {})
    assert not any(lacking(step_named(name), record) for name in moving)
    assert moving < resting_on(["bridge"])
    assert {"bridge", *moving} < resting_on(["memory"])
    assert set(record.drop(resting_on(["bridge"]))) == {*moving, "period", "model"}
    assert "stop" not in Record.of(tmp_path).steps


def test_a_result_of_another_memory_map_is_done_again(daq: CommandLine, tmp_path: Path) -> None:
    record = Record.of(tmp_path)
    record.keep("bridge", {"basis": {"port": MOCK, "memory_map": "of another one"}})
    record.keep("period", {})
    daq("config", "copy", "memory-map", "-o", tmp_path / "memory_map.toml")
    options = [word for step in STEPS for word in ("--skip", step.name)]
    assert "To be repeated" in daq("--port", MOCK, "commission", "--folder", tmp_path, *options).err
    assert Record.of(tmp_path).steps["bridge"]["skipped"]


def test_what_is_missing_or_damaged_is_one_line(daq: CommandLine, tmp_path: Path) -> None:
    record = Record.of(tmp_path)
    record.keep("potentiometers", {"joint_1": {"direction": 1}})
    with pytest.raises(SpecError, match="joint_1"):
        acceptance_sheet(record)
    record.drop(["potentiometers"])
    record.keep("memory", {})
    for damaged in ("{", "[]", "{}"):
        (tmp_path / "memory_findings.json").write_text(damaged, "utf-8")
        with pytest.raises(SpecError, match="damaged"):
            acceptance_sheet(record)


def test_a_period_that_a_busy_computer_blurs_is_not_known_and_a_dead_memory_not_alive() -> None:
    assert Periods(20.0, 0.01, 5.0).problem == ""
    assert "scatter of 69.2 ms" in Periods(19.679, 0.13, 69.2).problem
    assert [is_alive(data) for data in (bytes(128), b"\xff" * 128, bytes(range(128)))] == [False, False, True]


def test_lines_of_a_script_that_come_together_are_all_read() -> None:
    reading, writing = os.pipe()
    lines = Lines(reading)
    assert not lines.ready()
    os.write(writing, b"one\ntwo\n")
    assert lines.ready()
    assert lines.read() == "one\n"
    assert lines.ready()
    assert lines.read() == "two\n"
    os.close(writing)
    assert lines.ready()
    assert lines.read() == ""
    os.close(reading)


def test_an_angle_that_no_joint_has_is_asked_for_again_and_one_can_be_taken_back() -> None:
    lines = ["500\n", "50\n", "b\n", "ninety\n", "90.5\n", "\n"]
    person, waits = operator(lines), list[float]()
    answers = [person.read_angle(1, number, waits.append) for number in range(1, 5)]
    assert answers == [50, "taken back", 90.5, None]


def test_a_step_that_fails_leaves_the_results_that_there_were(daq: CommandLine, tmp_path: Path) -> None:
    record = Record.of(tmp_path)
    record.keep("ramp", {"trace": "gone.mcap", "basis": {"machine": "none"}})
    record.keep("model", {"verdict": "kept", "basis": {"machine": "none"}})
    assert daq("--port", MOCK, "commission", "--folder", tmp_path, "--only", "model").code != 0
    assert Record.of(tmp_path).steps["model"]["verdict"] == "kept"


def test_the_machine_file_stays_where_the_power_is_not_given_back_safely(tmp_path: Path) -> None:
    hand = Hand(times=1)  # presses the emergency stop, and does not switch the controller off and on
    call = Invocation(port_option=MOCK)
    bench = Bench(call, tmp_path, cast("Commissioner", hand), ConsentPrompt(True), Record.of(tmp_path), joints=())
    with pytest.raises(SafetyError, match="was not switched off and on"):
        potentiometers(bench)
    assert hand.tasks == ["press_emergency_stop", "switch_off_and_on"]
    assert not (tmp_path / "machine.toml").exists()
    assert Record.of(tmp_path).stop_pressed


def test_a_map_with_question_marks_is_refused_with_their_lines_before_anything_is_recorded(
    daq: CommandLine, tmp_path: Path
) -> None:
    (tmp_path / "memory_map.toml").write_text("version = 1\nlow = [?, 0xFC01]\n", "utf-8")
    said = daq("--port", MOCK, "commission", "--folder", tmp_path, "--skip", "memory")
    said.complains(2, "line 2", "each question mark")
    assert not (tmp_path / "commissioning.toml").exists()


def test_addresses_found_assumed_and_filled_in_by_hand_are_told_apart() -> None:
    shipped = default_memory_map()
    findings = [
        {"register": "power", "joint": joint, "verdict": "found", "low": f"{low:04X}"}
        for joint, low in enumerate(shipped["power"].low, start=1)
    ]
    findings[0] |= {"low": "FC7F"}  # found there, and changed by a person afterwards
    findings.append({"register": "gripper", "verdict": "assumed", "low": f"{shipped['gripper'].low[0]:04X}"})
    findings.append({"register": "process_outputs", "verdict": "unknown"})
    told = addresses_of({"findings": findings}, shipped)
    assert [len(told["power"][kind]) for kind in ("found", "assumed", "by hand")] == [5, 0, 1]
    assert told["gripper"]["assumed"] == ["FC72"]
    assert told["process_outputs"]["by hand"] == ["FC71"]


def test_every_task_that_takes_the_drives_power_says_that_the_arm_may_sink() -> None:
    assert "may sink" in words(Task("press_emergency_stop"))
    assert "keep a hand at the emergency stop" in words(Task("release_emergency_stop"))
    assert "once more: no byte follows it" in words(Task("lead", joint=1, again="no byte follows it"))


@pytest.mark.parametrize("options", ["", "&no_sample=1"])
def test_a_sound_controller_keeps_every_promise(daq: CommandLine, options: str) -> None:
    said = daq("--port", MOCK + options, "robot", "check", "--json")
    assert said.code == 0
    assert all(one["kept"] for one in json.loads(said.out))


def test_a_controller_whose_bridge_believes_in_a_wrong_map_breaks_some(daq: CommandLine) -> None:
    said = daq("--port", MOCK + "&secret_map=3&documented=moved", "robot", "check")
    assert said.code == 5
    assert "BROKEN  position + error is the set point" in said.out
