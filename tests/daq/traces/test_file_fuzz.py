"""Every reader of files takes damaged ones in one line, or says what is missing of them (`file_fuzz`)."""

from pathlib import Path

import pytest

from tests.daq.traces.file_fuzz import CASES, campaign, kinds


@pytest.mark.parametrize("cases", [700, pytest.param(CASES, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])])
def test_damaged_files_of_every_kind_are_refused_in_one_line_or_read_as_a_whole(tmp_path: Path, cases: int) -> None:
    tally = campaign(cases, 2, kinds(tmp_path))
    assert not tally.faults, "\n".join(tally.examples)
    assert tally.ends["read"] > cases // 20  # of texts few are read once they are damaged
