"""A file is written whole or not at all."""

from pathlib import Path

import pytest

from daq.contracts.whole_file import replacing


@pytest.mark.parametrize("synced", [True, False])
def test_the_old_file_stays_until_the_new_one_is_whole(tmp_path: Path, synced: bool) -> None:
    path = tmp_path / "result"
    path.write_text("old")
    with replacing(path, synced=synced) as part:
        part.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def _fails(path: Path) -> None:
    with replacing(path) as part:
        part.write_text("half")
        raise RuntimeError


def test_the_old_file_stays_where_writing_fails(tmp_path: Path) -> None:
    path = tmp_path / "result"
    path.write_text("old")
    with pytest.raises(RuntimeError):
        _fails(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_stays_and_points_at_the_new_file(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    link = tmp_path / "link"
    link.symlink_to("real")
    with replacing(link) as part:
        part.write_text("new")
    assert link.is_symlink()
    assert (tmp_path / "real").read_text() == "new"
