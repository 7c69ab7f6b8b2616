"""Compiled code is kept apart for every state of the sources."""

from __future__ import annotations

import os
from pathlib import Path

import numba

from model.dynamics.compilation import CACHE_DAYS, _remove_old, cache_folder, source_hash


def test_any_edit_gives_another_hash(tmp_path: Path) -> None:
    source = tmp_path / "physics.py"
    source.write_text("gravity = 9.8\n")
    before = source_hash(tmp_path)
    source.write_text("gravity = 9.9\n")
    edited = source_hash(tmp_path)
    source.rename(tmp_path / "renamed.py")
    assert len({before, edited, source_hash(tmp_path)}) == 3


def test_numba_caches_into_the_folder_of_these_sources() -> None:
    assert Path(numba.config.CACHE_DIR).name == source_hash()
    assert cache_folder().name == source_hash()


def test_only_old_caches_are_removed(tmp_path: Path) -> None:
    names = {"old": "0" * 16, "new": "1" * 16, "other": "not-ours"}
    for name in names.values():
        (tmp_path / name).mkdir()
    for name in ("old", "other"):
        os.utime(tmp_path / names[name], (0, 0))
    _remove_old(tmp_path, before=CACHE_DAYS * 86_400.0)
    assert sorted(p.name for p in tmp_path.iterdir()) == [names["new"], names["other"]]
