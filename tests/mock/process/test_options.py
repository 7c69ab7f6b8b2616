"""Options from command line and file; what cannot be is one line."""

from pathlib import Path

import pytest

from mock_controller.__main__ import main
from mock_controller.device import build_device
from mock_controller.options import Options, OptionsError, read_options


def test_options_are_what_was_given_and_defaults_else(tmp_path: Path) -> None:
    options = read_options(["--tcp", "127.0.0.1:0", "--start", "1,2,3,4,5,6", "--gains", "3,1,0", "--no-sample"])
    assert options == Options(tcp="127.0.0.1:0", start=(1, 2, 3, 4, 5, 6), gains=(3, 1, 0), sample=False)


def test_arguments_win_over_the_file_and_lists_are_joined(tmp_path: Path) -> None:
    file = tmp_path / "mock.toml"
    file.write_text('pty = true\nseed = 3\nlock-step = true\nbaud = 9600\nfault = ["drop:rate=0.1"]\n', "utf-8")
    options = read_options(["--config", str(file), "--seed", "4", "--fault", "flip"])
    assert options == Options(pty=True, seed=4, lock_step=True, baud=9600, fault=("drop:rate=0.1", "flip"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "nowhere to be reached: give --pty or --tcp HOST:PORT"),
        (["--pty", "--tcp", "127.0.0.1:0"], "pty and tcp: give one of them"),
        (["--tcp", "127.0.0.1:0", "--link", "x"], "link: a name for the pseudo-terminal needs --pty"),
        (["--pty", "--baud", "fast"], "argument --baud: invalid int value: 'fast'"),
        (["--pty", "--baud", "0"], "baud: input should be greater than or equal to 300, is 0"),
        (["--pty", "--start", "1,2,3"], "start: "),
        (["--pty", "--start", "1,2,3,4,5,1000"], "start 5: input should be less than 1000, is '1000'"),
        (["--pty", "--gains", "2,0,21"], "gains 2: input should be less than or equal to 20, is '21'"),
        (["--pty", "--gains", "2,0"], "gains 2: field required"),
        (["--pty", "--seed", "-1"], "seed: input should be greater than or equal to 0, is -1"),
        (["--pty", "--colour"], "unrecognized arguments: --colour"),
        (["--config", "missing.toml"], "config: missing.toml: No such file or directory"),
        (["--tcp", "nonsense"], "tcp: 'nonsense': write HOST:PORT"),
        (["--tcp", "127.0.0.1:70000"], "tcp: '127.0.0.1:70000': write HOST:PORT"),
        (["--tcp", "127.0.0.1:0", "--control", "here"], "control: 'here': write HOST:PORT"),
        (["--pty", "--fault", "flop"], "fault 'flop': not known"),
        (["--pty", "--fault", "flip:rate=2"], "fault flip: rate is 2, allowed are 0.0 to 1.0"),
        (["--pty", "--modify", "gremlin"], "modification 'gremlin': not known"),
        (["--pty", "--modify", "payload:mass"], "modification payload: 'mass': write parameter=value"),
        (["--pty", "--plant", "missing.toml"], "plant: missing.toml: No such file or directory"),
        (["--pty", "--board", "missing.toml"], "board: missing.toml: No such file or directory"),
        (["--pty", "--memory-map", "missing.toml"], "memory-map: missing.toml: No such file or directory"),
        (["--pty", "--link", "missing/folder/arm"], "link: missing/folder/arm: No such file or directory"),
    ],
)
def test_wrong_options_are_one_line_and_exit_code_2(
    arguments: list[str],
    words: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"mock_controller: {words}")
    assert said.err.count("\n") == 1


@pytest.mark.parametrize("text", ["pty = ", "colour = 'red'\npty = true", "pty = 'perhaps'"])
def test_a_wrong_file_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "mock.toml"
    file.write_text(text, "utf-8")
    with pytest.raises(OptionsError):
        read_options(["--config", str(file)])


def test_start_posture_gains_and_hidden_effects_reach_board_and_arm() -> None:
    chosen = Options(
        tcp="x", start=(100, 400, 500, 600, 500, 500), gains=(4, 1, 2), modify=("payload:mass=0.5,offset=0.1",)
    )
    device = build_device(chosen, lambda _: None)
    memory = device.board.memory
    assert chosen.start is not None
    assert all(abs(at - wanted) <= 3 for at, wanted in zip(memory.values("set_point"), chosen.start, strict=True))
    assert [memory.values(name)[0] for name in ("gain_p", "gain_i", "gain_d")] == [4, 1, 2]
    assert device.board.plant.parameters.rigid_body.m_load == pytest.approx(1.250307 + 0.5)
    assert device.modifications == ("payload:mass=0.5,offset=0.1",)


@pytest.mark.parametrize("word", ["--help", "--help-faults"])
def test_help_explains_and_leaves(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        read_options([word])
    assert left.value.code == 0
    assert "--lock-step" in (text := capsys.readouterr().out) or "busy_memory" in text
