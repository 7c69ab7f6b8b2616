"""The files that git tracks, which are what a user gets."""

import subprocess
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]


@cache
def tracked_files() -> tuple[Path, ...]:
    """The tracked files that are still there, as absolute paths."""
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return tuple(path for name in names.split("\0") if name and (path := ROOT / name).is_file())


def tracked_texts(pattern: str = "*") -> list[tuple[Path, str]]:
    """The tracked files whose name matches the pattern and that are text, each with its text."""
    texts = []
    for path in tracked_files():
        if path.match(pattern):
            try:
                texts.append((path, path.read_text(encoding="utf-8")))
            except UnicodeDecodeError:  # a picture or a trace
                continue
    return texts
