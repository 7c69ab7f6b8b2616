"""A batch: every trace once in the table, whatever was interrupted, failed, or done before."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

from daq.contracts.errors import ReachError, SpecError
from daq.contracts.progress import CancelledError
from daq.contracts.service.jobs import DiagnoseRequest, DiagnoseStudy, FitRequest
from daq.contracts.service.study_options import options_of
from daq.executors import Workers
from daq.traces.catalogue import list_traces
from daq.traces.query import TraceQuery
from daq.traces.reader import read_trace
from daq_cli.models.service_jobs import _given
from extras.lab.batches.folder import BatchFolder, asked_of, opened
from extras.lab.batches.run import Chosen, Standing, chosen_traces, run_batch
from extras.lab.batches.study import Answer, Common, SimulateStudy
from model.discrepancy.options import DiagnosisOptions, torque_options
from model.fitting.options import FitOptions
from model.machine_model.model import base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.daq.executors.by_hand import WorkersByHand
from tests.extras.lab.batches.traces import MACHINE, folder_of_traces, number

COMMON = Common(study=SimulateStudy(), model=None, machine=MACHINE)


def chosen(folder: Path) -> list[Chosen]:
    return chosen_traces(list_traces(folder), TraceQuery())[0]


def run(out: Path, traces: Path, workers: Workers | None = None, common: Common = COMMON) -> Standing:
    with opened(out, asked_of(common)) as folder:
        return run_batch(folder, common, chosen(traces), workers or WorkersByHand())


def table(out: Path) -> list[dict[str, str]]:
    with (out / "table.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture
def traces(tmp_path: Path) -> Path:
    return folder_of_traces(tmp_path / "traces", 3)


def test_the_table_has_what_a_simulation_of_each_trace_gives(tmp_path: Path, traces: Path) -> None:
    ended = run(tmp_path / "out", traces)
    assert (ended.total, ended.done, ended.failed, ended.left) == (3, 3, 0, 0)
    rows = table(tmp_path / "out")
    assert [row["trace"] for row in rows] == [number(index) for index in range(3)]
    for row in rows:
        trace = read_trace(traces / row["file"])
        made = simulate(base_model(MACHINE), trace, Options())
        apart = trace.position[:, 1] - made.at_samples(made.reading)[:, 1]
        assert float(row["joint2.largest"]) == pytest.approx(np.abs(apart).max(), rel=1e-6)
        assert (row["state"], row["problem"]) == ("done", "")


@pytest.mark.parametrize(
    ("study", "simulated", "balanced"),
    [(DiagnoseStudy(), 3, 8), (DiagnoseStudy(most_steps=3), 3, 3), (DiagnoseStudy(most_steps=5), 5, 5)],
)
def test_a_number_of_steps_that_is_not_given_is_the_methods_own(
    study: DiagnoseStudy, simulated: int, balanced: int
) -> None:
    options = options_of(DiagnoseStudy.model_validate_json(study.model_dump_json()), DiagnosisOptions)
    assert (options.most_steps, torque_options(options).most_steps) == (simulated, balanced)


def test_a_job_has_every_option_that_was_given_and_refuses_what_it_cannot_have() -> None:
    given = DiagnosisOptions(despite_doubts=True, most_steps=2)
    request = DiagnoseRequest(traces=("a",), **_given(given))
    assert options_of(DiagnoseRequest.model_validate_json(request.model_dump_json()), DiagnosisOptions) == given
    fit = FitOptions(held=("joint1.*",), bounds={"load.mass": (0.0, None)}, loop="open", seed=3)
    assert options_of(FitRequest(traces=("a",), **_given(fit)), FitOptions) == fit
    with pytest.raises(SpecError, match="rounds"):
        FitRequest(traces=("a",), **_given(FitOptions(rounds=2)))


def test_parquet_and_csv_hold_the_same_and_the_answers_are_kept_whole(tmp_path: Path, traces: Path) -> None:
    out = tmp_path / "out"
    run(out, traces)
    read = parquet.read_table(out / "table.parquet").to_pylist()
    for ours, theirs in zip(table(out), read, strict=True):
        assert ours == {name: "" if value is None else str(value) for name, value in theirs.items()}
    assert type(read[0]["joint1.error"]) is float
    answer = json.loads((out / "answers" / f"{number(0)}.json").read_text("utf-8"))
    assert answer["joints"][0]["rmse"] == read[0]["joint1.error"]


def test_what_is_done_is_not_done_again_and_what_failed_is(tmp_path: Path, traces: Path) -> None:
    out, broken = tmp_path / "out", traces / "broken.mcap"
    broken.write_text("no trace")
    first, second = WorkersByHand(), WorkersByHand()
    ended = run(out, traces, first)
    assert (ended.done, ended.failed) == (3, 1)
    assert "is not an MCAP file" in next(row["problem"] for row in table(out) if row["state"] == "failed")
    ended = run(out, folder_of_traces(tmp_path / "more", 5), second)
    assert (ended.total, ended.before, ended.done) == (5, 3, 2)
    assert [job.key for job in second.given] == [number(3), number(4)]
    assert sorted(row["trace"] for row in table(out)) == [*map(number, range(5)), "broken.mcap"]


def test_an_interrupted_batch_keeps_what_it_has_and_goes_on(tmp_path: Path, traces: Path) -> None:
    class Now:
        def is_set(self) -> bool:
            return True

    out = tmp_path / "out"
    with opened(out, asked_of(COMMON)) as folder, pytest.raises(CancelledError):
        run_batch(folder, COMMON, chosen(traces), WorkersByHand(), cancel=Now())
    assert len(table(out)) == 1
    assert run(out, traces).done == 2
    assert [row["trace"] for row in table(out)] == [number(index) for index in range(3)]


def test_a_line_that_a_crash_cut_short_is_studied_again(tmp_path: Path, traces: Path) -> None:
    out = tmp_path / "out"
    run(out, traces)
    rows = out / "rows.jsonl"
    rows.write_bytes(rows.read_bytes()[:-40])
    assert (run(out, traces).done, len(rows.read_text("utf-8").splitlines())) == (1, 3)


def test_rows_are_read_whatever_characters_they_hold_and_wherever_a_crash_cut_them(tmp_path: Path) -> None:
    strange = "run \u2028 \u2029 \u0085 \x0b 20 °C"
    with opened(tmp_path, asked_of(COMMON)) as folder:
        folder.add(Answer(key="first"), {"name": strange})
    with (tmp_path / "rows.jsonl").open("ab") as rows:
        rows.write('{"key": "20 °'.encode()[:-1])
    for _ in range(2):
        with opened(tmp_path, asked_of(COMMON)) as folder:
            assert [row.about for row in folder.rows] == [{"name": strange}]
    with (tmp_path / "rows.jsonl").open("ab") as rows:
        rows.write(b"\xff\n")
    with pytest.raises(SpecError, match="a line is not UTF-8"), opened(tmp_path, asked_of(COMMON)):
        pass


def test_a_fault_of_the_program_fails_one_trace_and_no_other(tmp_path: Path, traces: Path) -> None:
    def tell(standing: Standing, _row: object) -> None:
        said.append(str(standing))

    said: list[str] = []
    workers = WorkersByHand(dies=lambda job, _time: job.key == number(1))
    with opened(tmp_path / "out", asked_of(COMMON)) as folder:
        ended = run_batch(folder, COMMON, chosen(traces), workers, tell)
    assert (ended.done, ended.failed) == (2, 1)
    assert "its worker process ended each time" in table(tmp_path / "out")[1]["problem"]
    assert said[0] == "0 of 3 done"
    assert said[-1] == "2 of 3 done, 1 failed"
    assert " a minute, " in said[1]


def test_another_batch_does_not_go_on_in_the_folder(tmp_path: Path, traces: Path) -> None:
    out = tmp_path / "out"
    run(out, traces)
    other = COMMON.model_copy(update={"study": SimulateStudy(quantise=False)})
    with pytest.raises(SpecError, match="another study, or other options; use another folder"):
        run(out, traces, common=other)
    named = COMMON.model_copy(update={"model": base_model(MACHINE).model_dump_json()})
    with pytest.raises(SpecError, match="another model"):
        run(out, traces, common=named)
    elsewhere = COMMON.model_copy(update={"machine": MACHINE.model_copy(update={"name": "another"})})
    with pytest.raises(SpecError, match="another machine for traces that name none"):
        run(out, traces, common=elsewhere)
    with opened(out, asked_of(COMMON)), pytest.raises(ReachError, match="another batch is computing into it"):
        run(out, traces)


def test_a_trace_in_two_files_is_studied_once(tmp_path: Path, traces: Path) -> None:
    (traces / "copy.mcap").write_bytes((traces / "000.mcap").read_bytes())
    found, remarks = chosen_traces(list_traces(traces), TraceQuery(words=("RUN",)))
    assert len(found) == 3
    assert len(remarks) == 1
    assert "is the same trace as" in remarks[0]


def test_a_folder_that_is_no_batch_is_told(tmp_path: Path, traces: Path) -> None:
    out = tmp_path / "out"
    run(out, traces)
    (out / "rows.jsonl").write_text('{"trace": 1}\n')
    with pytest.raises(SpecError, match="a line is not a row of a batch"), opened(out, asked_of(COMMON)):
        pass
    (out / "batch.json").write_text("[]")
    with pytest.raises(SpecError, match="not a batch's"), opened(out, asked_of(COMMON)):
        pass
    assert BatchFolder(out, {}).rows == []
