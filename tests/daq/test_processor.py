"""What the kernel says of a process' wait for a processor."""

from pathlib import Path

from daq.contracts.processor import ProcessorTime, added, processor_time


def test_the_times_of_all_threads_are_added_and_those_of_processes_too(tmp_path: Path) -> None:
    for process, thread, counted in (
        ("7", "7", "1000000000 250000000 12"),
        ("7", "8", "500000000 0 1"),
        ("9", "9", "0 2000000000 3"),
    ):
        (tmp_path / process / "task" / thread).mkdir(parents=True)
        (tmp_path / process / "task" / thread / "schedstat").write_text(counted + "\n")
    of_7 = processor_time(7, tmp_path)
    assert of_7 == ProcessorTime(1.5, 0.25)
    assert added([of_7, processor_time(9, tmp_path), None]) == ProcessorTime(1.5, 2.25)
    assert added([None]) is None


def test_nothing_is_known_of_a_process_that_is_gone_or_where_the_kernel_does_not_count(tmp_path: Path) -> None:
    assert processor_time(7, tmp_path) is None
    (tmp_path / "7" / "task" / "7").mkdir(parents=True)
    (tmp_path / "7" / "task" / "7" / "schedstat").write_text("")
    assert processor_time(7, tmp_path) is None
