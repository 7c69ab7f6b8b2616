"""A blind trial from seeds to the table: what each stage is told, what it keeps, and what it refuses."""

import json
import subprocess
import sys
import tomllib
from hashlib import sha256
from pathlib import Path
from typing import Any

import grimp
import numpy as np
import pytest
from mcap.stream_reader import StreamReader

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, Ramp
from daq.contracts.machine import load_machine
from daq.executors.local import ending
from daq.traces.reader import read_trace
from model.discrepancy.diagnosis import Diagnosis
from model.machine_model.model import base_model
from tests.daq.executors.by_hand import WorkersByHand, WorkersInThreads
from tests.daq_cli.invoke import CommandLine
from trials.blind.campaign import Campaign
from trials.blind.folder import TrialFolder
from trials.blind.recording import Recorded, machine_with_load
from trials.blind.registered import REGISTERED, library_versions, source_tree, to_register, tree_hashes
from trials.blind.registration import compose
from trials.blind.sealed import TrialStageError, diagnose_sealed

FAKE = (sys.executable, str(Path(__file__).with_name("fake_diagnoser.py")))
MACHINE = load_machine("ma2000")
SECRETS = [compose(7654321, "single", "heavy"), compose(7654321, "clean", "nominal")]
pytestmark = pytest.mark.timeout(300)  # a trial of two arms is a dozen processes one after the other
STAGES = ("detect", "record", "diagnose", "score")


def short(name: str) -> ExperimentSpec:
    """The trial's experiments, much shorter."""
    return ExperimentSpec(
        trajectory=Ramp(amplitude=0.1, duration=0.3), joints=(1, 2, 3), settle=0.1, hold=0.2, name=name
    )


def trial(path: Path, until: Any = "score") -> Campaign:
    folder = TrialFolder.open(path, "ramp", None)
    return Campaign(folder, MACHINE, FAKE, until, experiment=short)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    """A trial of two arms, from the first stage to the last."""
    path = tmp_path_factory.mktemp("trial")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DAQ_RUNTIME_FOLDER", str(path / "run"))
        made = trial(path)
        said: list[str] = []
        with ending(WorkersInThreads(2)) as workers:
            made.run(SECRETS, workers, lambda _number, line: said.append(line))
    assert [line.partition(": ")[2] for line in said] == ["done", "done"]
    return made


def rows(done: Campaign, stage: Any) -> dict[int, dict[str, Any]]:
    return {row["seed"]: row for row in done.folder.rows(stage)}


def given(done: Campaign, seed: int) -> dict[str, Any]:
    """What the diagnosing process saw of the world."""
    file = done.folder.path / "answers" / rows(done, "diagnose")[seed]["answer"]
    told: dict[str, Any] = json.loads(Diagnosis.model_validate_json(file.read_text("utf-8")).notes[0])
    return told


def everything_in(file: Path) -> str:
    """All records of a trace, decompressed."""
    with file.open("rb") as stream:
        return "\n".join(repr(record) for record in StreamReader(stream).records)


def test_every_stage_writes_one_line_for_each_case(done: Campaign) -> None:
    for stage in STAGES:
        assert set(rows(done, stage)) == set(SECRETS), stage
    table = done.table()
    assert (table.cases, table.kinds) == (2, {"single": 1, "clean": 1})
    false_alarm = next(line for line in table.lines if line.what.startswith("false alarm"))
    assert (false_alarm.rate.hits, false_alarm.rate.cases) == (0, 1)


def test_the_diagnosis_is_given_traces_and_the_model_and_nothing_else(done: Campaign) -> None:
    told = given(done, SECRETS[0])
    assert told["files"] == ["held-out.mcap", "model.json", "trace-1.mcap"]
    assert told["arguments"] == []
    assert "DAQ_RUNTIME_FOLDER" not in told["environment"]
    everything = json.dumps(told)
    for seed in SECRETS:
        assert str(seed) not in everything
        assert str(seed // 100) not in everything


def test_the_diagnosis_is_given_the_announced_load(done: Campaign) -> None:
    assert given(done, SECRETS[0])["load"] == 2.0
    assert given(done, SECRETS[1])["load"] == pytest.approx(1.250307)
    announced = machine_with_load(MACHINE, 0.4).load
    own = MACHINE.load
    assert announced.deviation == pytest.approx(0.4 * own.deviation / own.value)  # as uncertain as the file's own


def test_traces_and_case_names_do_not_reveal_the_hidden_effects(done: Campaign) -> None:
    names = [file.name for file in done.folder.path.rglob("*")]
    for seed, row in rows(done, "record").items():
        number = str(seed // 100)
        noises = [int(sha256(f"noise {seed} {run}".encode()).hexdigest()[:7], 16) for run in ("ramp", "held-out")]
        for name in (row["trace"], row["held_out"]):
            inside = everything_in(done.folder.path / "traces" / name)
            assert "ramp" in inside, "the records are readable here"
            for telling in (str(seed), number, *map(str, noises), "secret"):
                assert telling not in inside, telling
        assert not any(number in name for name in names)


def test_the_two_traces_of_an_arm_have_different_noise(done: Campaign) -> None:
    row = rows(done, "record")[SECRETS[0]]
    first, second = (read_trace(done.folder.path / "traces" / row[key]) for key in ("trace", "held_out"))
    assert first.record.trace_id != second.record.trace_id
    assert (first.position != second.position).any()


def resumed(path: Path, done: Campaign) -> Campaign:
    """Another trial of the arm that carries much, recorded already."""
    copy = trial(path)
    for stage in ("detect", "record"):
        copy.folder.add(stage, rows(done, stage)[SECRETS[0]])
    for file in (done.folder.path / "traces").iterdir():
        (path / "traces" / file.name).write_bytes(file.read_bytes())
    return copy


def test_nothing_is_begun_once_the_time_is_over(tmp_path: Path) -> None:
    stopped = trial(tmp_path, until="detect")
    assert stopped.run(SECRETS, WorkersByHand(), lambda _number, _said: None, seconds=0.0) == 0
    assert stopped.folder.rows("detect") == []
    assert stopped.table().cases == 0


def test_a_trial_can_be_resumed_from_its_lines_in_another_folder(done: Campaign, tmp_path: Path) -> None:
    for name in ("trial.json", *(f"{stage}.jsonl" for stage in STAGES)):
        (tmp_path / name).write_bytes((done.folder.path / name).read_bytes())
    again = Campaign(TrialFolder.open(tmp_path, "ramp", None), MACHINE, ("/no/diagnoser",))
    assert again.run(SECRETS, WorkersByHand(), lambda _number, _said: None) == 0
    assert again.table() == done.table()
    assert not list((tmp_path / "traces").iterdir())


def test_an_answer_that_was_changed_after_it_was_sealed_is_not_scored(done: Campaign, tmp_path: Path) -> None:
    answers, sealed = done.folder.path / "answers", rows(done, "diagnose")[SECRETS[1]]
    copy = trial(tmp_path)
    copy.folder.add("detect", rows(done, "detect")[SECRETS[1]])
    copy.folder.add("diagnose", sealed)
    (tmp_path / "answers" / sealed["answer"]).write_bytes((answers / sealed["answer"]).read_bytes() + b" ")
    with pytest.raises(TrialStageError, match="differs from the one that was sealed"):
        copy._score(SECRETS[1])


def test_the_order_of_cases_reveals_nothing(done: Campaign) -> None:
    seeds = [compose(number, kind, "nominal") for kind in ("clean", "single") for number in range(20)]
    order = done.folder.in_order(seeds)
    assert sorted(order) == sorted(seeds)
    assert order not in (seeds, sorted(seeds))
    assert order == trial(done.folder.path).folder.in_order(seeds[::-1])


def test_a_folder_of_another_trial_is_refused(done: Campaign) -> None:
    with pytest.raises(SpecError, match="holds a trial with other options"):
        TrialFolder.open(done.folder.path, "diagnostic", None)


def test_a_stage_whose_line_was_cut_short_is_repeated(tmp_path: Path) -> None:
    folder = trial(tmp_path).folder
    folder.add("detect", {"seed": 110})
    with (tmp_path / "detect.jsonl").open("a", encoding="utf-8") as file:
        file.write('{"seed": 12')
    again = trial(tmp_path).folder
    assert [row["seed"] for row in again.rows("detect")] == [110]
    again.add("detect", {"seed": 120})
    assert [row["seed"] for row in trial(tmp_path).folder.rows("detect")] == [110, 120]


def test_a_case_whose_process_is_killed_is_not_done_and_the_others_are(done: Campaign, tmp_path: Path) -> None:
    copy = trial(tmp_path, until="record")
    for seed in SECRETS:
        copy.folder.add("detect", rows(done, "detect")[seed])
    copy.recorder = lambda _seed, name, *_: Recorded(tmp_path / f"{name}.mcap", "complete", "", 8.0)
    said: list[str] = []
    workers = WorkersByHand(dies=lambda task, _time: task.seed == SECRETS[0])
    assert copy.run(SECRETS, workers, lambda _number, line: said.append(line)) == 1
    assert [row["seed"] for row in copy.folder.rows("record")] == [SECRETS[1]]
    assert sorted(line.partition(": ")[2] for line in said) == ["done", "killed"]


def test_a_diagnosis_that_gives_no_answer_says_why(tmp_path: Path, done: Campaign) -> None:
    model = base_model(MACHINE)
    with pytest.raises(TrialStageError, match="ended with code 3: no idea"):
        diagnose_sealed(
            [], None, model, (sys.executable, "-c", "import sys; print('no idea', file=sys.stderr); sys.exit(3)")
        )
    silent = resumed(tmp_path, done)
    silent.diagnoser = (sys.executable, "-c", "raise SystemExit(1)")
    row = silent._diagnose(SECRETS[0])
    assert row["failure"] == "the diagnosis ended with code 1: it said nothing"
    silent.folder.add("diagnose", row)
    assert silent._score(SECRETS[0])["place"] == "failed"


def test_hashes_prints_the_tables_of_a_registration(daq: CommandLine) -> None:
    printed = tomllib.loads(daq("blind", "--folder", "trial", "--hashes").out)
    expected = tree_hashes()
    assert printed == {"hashes": expected, "versions": library_versions()}
    assert set(library_versions()) == {"numpy", "scipy", "numba", "mujoco"}
    assert library_versions()["numpy"] == np.__version__
    assert {"model/discrepancy", "mock_controller", "trials/blind"} <= set(expected)
    thresholds = "model/discrepancy/thresholds.py"
    assert expected[thresholds] == sha256((source_tree() / thresholds).read_bytes()).hexdigest()


STAGE_MODULES = ("trials.blind", "daq.owner", "mock_controller")
AROUND = ("daq_cli", "daq.client", "daq.config", "daq.executors")
"""What only the command line around a trial uses, which decides nothing."""


def test_nothing_that_a_stage_imports_is_left_out_of_a_registration() -> None:
    every = ("daq", "daq_cli", "model", "mock_controller", "firmware_protocol", "trials")
    graph = grimp.build_graph(*every, exclude_type_checking_imports=True, cache_dir=None)
    begun = {name for name in graph.modules if any(f"{name}.".startswith(f"{stage}.") for stage in STAGE_MODULES)}
    used = begun.union(*(graph.find_upstream_modules(name) for name in begun))
    assert {"model.discrepancy.workflow", "daq.link.link", "model.fitting.identifiability"} <= used
    registered = [path.removesuffix(".py").replace("/", ".") for path in REGISTERED]
    packages = {"daq", "model"}  # of which only the registered parts are used
    left = [name for name in used - packages if not any(f"{name}.".startswith(f"{p}.") for p in (*registered, *AROUND))]
    assert left == []


def git(folder: Path, *words: str) -> str:
    identity = ("-c", "user.name=test", "-c", "user.email=test@example.org", "-c", "commit.gpgsign=false")
    return subprocess.run(
        ["git", *identity, *words], cwd=folder, check=True, capture_output=True, text=True
    ).stdout.strip()


def test_a_registered_trial_runs_only_committed_and_with_the_code_that_was_registered(
    daq: CommandLine, empty_folder: Path
) -> None:
    path = "model/trial"
    digest = tree_hashes([path])[path]
    begun = 'version = 1\ntitle = "t"\ndetectable = 5.0\nruns.diagnostic.cases.clean = 1\n'
    text = begun + to_register() + "\n"
    file = empty_folder / "registration.toml"
    file.write_text(text, "utf-8")
    git(empty_folder, "init", "-q")
    words = ("blind", "--folder", "trial", "--registration", file, "--until", "detect")
    daq(*words).complains(2, "has uncommitted changes")
    git(empty_folder, "add", file.name)
    git(empty_folder, "commit", "-q", "-m", "registered")
    daq(*words, "--seeds", "1:2").complains(2, "--seeds and --registration")
    daq(*words, "--cases", "1").complains(2, "--cases and --registration")
    daq(*words, "--kinds", "clean").complains(2, "--kinds and --registration")
    daq(*words, "--run", "ramp").complains(2, "run 'ramp': the registration has diagnostic")
    kept = empty_folder / "registration-diagnostic.md"
    kept.write_text("a table", "utf-8")
    daq(*words).complains(2, "registration-diagnostic.md: this run has already been made")
    kept.unlink()
    file.write_text(text.replace(digest, "0" * 64), "utf-8")
    daq(*words).complains(2, f"{path}: not as registered")
    file.write_text(begun + f'hashes."{path}" = "{digest}"\n', "utf-8")
    daq(*words).complains(2, "lacks model/discrepancy/thresholds.py, model/discrepancy, model/arrays.py and")
