"""Finds faults that no test notices: makes small ones in the code, and runs the tests of the same folder against each.

    python -m benchmarks mutation daq/link firmware_protocol --sample 100 --seed 1 --processes 2

Each path is a folder or a file. Each mutant (see `mutants`) is tried in a temporary copy of the tree. The tests are
those of the folder of `tests` that mirrors the module's (`tests/daq/link` for `daq/link`; where there is none, the
folder above). The quickest file runs first, and the first failure ends the run. Tests are left out if they are marked
slow, or need a browser, a real arm or measured traces. A mutant also counts as killed when the tests take longer than
three times their time and 20 s (240 s for the model, which has to compile).

The output is each survivor with file, line and change, and the share killed of each path. A survivor asks for a test.
One that no test could notice is entered in equivalent_mutants.toml with the reason, and is then left out: after the
sample is drawn, so that a seed keeps its sample. The exit code is 1 where less than 90 % of a path's mutants are
killed.

--sample N    as many mutants of each path, drawn with --seed (all of them without it), whatever other paths there are
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from queue import SimpleQueue
from random import Random

from benchmarks.mutants import Mutant, mutants_of

ROOT = Path(__file__).parents[1]
EQUIVALENT = Path(__file__).with_name("equivalent_mutants.toml")
TEST_FOLDERS = {
    Path("firmware_protocol", "bridge"): "firmware",
    Path("firmware_protocol"): "protocol",
    Path("mock_controller"): "mock",
}
"""Folders whose folder of tests has another name; of a folder and one inside it, the inner one first."""

LEFT_OUT = "not slow and not browser and not hardware and not lab_data"
TARGET = 0.9
"""Least share of mutants that the tests of a folder should kill."""
GRACE_S = 20.0
"""Time limit of a mutant beyond three times that of the unchanged tests; the start of pytest varies by seconds."""
COMPILING_S = 240.0
"""The same for a mutant of the model, whose compiled functions must be compiled again."""
BASELINE_LIMIT_S = 7200.0
"""Time limit of the unchanged tests of a folder."""
_DURATION = re.compile(r"(\d+\.\d+)s (?:call|setup|teardown) +(\S.*)")
"""A line of `pytest --durations`."""
_TIMES = count(1_000_000_000, 10)
"""Modification times, all different, since Python recognises valid bytecode by its source's time and size."""


@dataclass(frozen=True)
class Tests:
    """The tests for the mutants of a module, and their time without a fault."""

    files: tuple[str, ...]
    seconds: float


def chosen_tests(files: Iterable[str], seconds: Mapping[str, float]) -> Tests:
    """Returns the tests of some files, the quickest file first. `seconds`: time of each file's unchanged tests."""
    ordered = tuple(sorted(files, key=lambda file: seconds.get(file, 0.0)))
    return Tests(ordered, sum(seconds.get(file, 0.0) for file in ordered))


@dataclass(frozen=True)
class Outcome:
    """Result of one mutant: `killed`, `timed out` (killed as well), `survived` or `no tests`."""

    mutant: Mutant
    ending: str

    @property
    def lives(self) -> bool:
        """Whether no test noticed it."""
        return self.ending in ("survived", "no tests")


class MutationError(Exception):
    """The tests cannot be used for mutants; the message says why."""


# ---- which mutants


def equivalents(file: Path = EQUIVALENT) -> dict[tuple[str, str, str, str], str]:
    """Returns the reason for each mutant that no test could notice, by its identity."""
    entries = tomllib.loads(file.read_text("utf-8")).get("mutant", [])
    return {(each["file"], each["function"], each["was"], each["now"]): each["reason"] for each in entries}


def mutants_below(path: str, root: Path = ROOT) -> list[Mutant]:
    """Returns all mutants of a file or a folder (relative to the root)."""
    place = root / path
    files = [place] if place.is_file() else sorted(place.rglob("*.py"))
    if not files:
        raise MutationError(f"{path}: there is no Python file")
    return [mutant for file in files for mutant in mutants_of(file.read_bytes(), file.relative_to(root).as_posix())]


# ---- which tests


def mirrored_folder(file: str, root: Path = ROOT) -> Path:
    """Returns the folder of tests for a module: the same path below `tests`, or the nearest folder above that
    exists.
    """
    parent = Path(file).parent
    renamed = next((outer for outer in TEST_FOLDERS if parent.is_relative_to(outer)), None)
    inner = parent if renamed is None else TEST_FOLDERS[renamed] / parent.relative_to(renamed)
    folder = root / "tests" / inner
    while not folder.is_dir():
        folder = folder.parent
    return folder


def files_of_tests(file: str, root: Path = ROOT) -> tuple[str, ...]:
    """Returns the files of the mirrored folder of tests."""
    files = sorted(mirrored_folder(file, root).rglob("test_*.py"))
    return tuple(test.relative_to(root).as_posix() for test in files)


# ---- running them


def copy_of_tree(target: Path) -> None:
    """Copies the files that git tracks or would track, and the built page if there is one."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    for name in listed.stdout.decode().split("\0"):
        if name and (ROOT / name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target / name)
    page = Path("server", "dashboard", "dist")
    if (ROOT / page).is_dir():
        shutil.copytree(ROOT / page, target / page, dirs_exist_ok=True)


def run_tests(tree: Path, arguments: Iterable[str], limit_s: float) -> tuple[int | None, list[str]]:
    """Returns pytest's exit code for the tests of a copy, and the printed lines.

    The code is None if they took too long; everything they began was then ended.
    """
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", LEFT_OUT, *arguments]
    environment = os.environ | {"PYTHONPATH": str(tree), "CI": "", "NUMBA_CACHE_DIR": str(tree / ".compiled")}
    with (
        tempfile.TemporaryFile("w+", errors="replace") as output,
        subprocess.Popen(
            command, cwd=tree, env=environment, stdout=output, stderr=subprocess.DEVNULL, start_new_session=True
        ) as process,
    ):
        code = None
        try:
            code = process.wait(limit_s)
        except subprocess.TimeoutExpired:
            pass
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        output.seek(0)
        return code, output.read().splitlines()


def first_failure(lines: Iterable[str]) -> str:
    """Returns the first failed test; "" if none failed."""
    return next((line.split(" - ")[0] for line in lines if line.startswith(("FAILED ", "ERROR "))), "")


def measured(tree: Path, files: Iterable[str]) -> dict[str, float]:
    """Returns the time (s) of each file's unchanged tests.

    Raises MutationError if a test fails.
    """
    code, lines = run_tests(tree, ["--durations=0", *files], BASELINE_LIMIT_S)
    if code not in (0, 5):  # pytest's 5: there was no test
        raise MutationError(f"the tests fail without any fault (exit code {code}; {first_failure(lines)})")
    seconds: Counter[str] = Counter()
    for found in filter(None, map(_DURATION.match, lines)):
        seconds[found[2].partition("::")[0]] += float(found[1])  # type: ignore[assignment]
    return dict(seconds)


def outcome(tree: Path, mutant: Mutant, tests: Tests) -> Outcome:
    """Runs the tests of a copy against one mutant, and restores the file."""
    if not tests.files:
        return Outcome(mutant, "no tests")
    file = tree / mutant.file
    unchanged, changed_at = file.read_bytes(), file.stat().st_mtime_ns
    _write(file, mutant.applied(unchanged), next(_TIMES) * 10**9)
    try:
        grace = COMPILING_S if mutant.file.startswith("model/") else GRACE_S
        code, _ = run_tests(tree, tests.files, 3.0 * tests.seconds + grace)
    finally:
        _write(file, unchanged, changed_at)
    ending = {None: "timed out", 0: "survived", 5: "no tests"}.get(code, "killed")
    return Outcome(mutant, ending)


def _write(file: Path, content: bytes, changed_at_ns: int) -> None:
    file.write_bytes(content)
    os.utime(file, ns=(changed_at_ns, changed_at_ns))


def run_all(mutants: list[Mutant], processes: int) -> list[Outcome]:
    """Tries mutants in as many copies of the tree as there may be processes, and prints each survivor at once."""
    with tempfile.TemporaryDirectory(prefix="mutation-") as folder:
        trees: SimpleQueue[Path] = SimpleQueue()
        for number in range(processes):
            tree = Path(folder, str(number))
            copy_of_tree(tree)
            trees.put(tree)

        def attempt(mutant: Mutant) -> Outcome:
            tree = trees.get()
            try:
                ended = outcome(tree, mutant, chosen_tests(files_of_tests(mutant.file), seconds))
            finally:
                trees.put(tree)
            if ended.lives:
                print(f"{ended.ending}: {mutant}", flush=True)
            return ended

        tree = trees.get()
        seconds = measured(tree, dict.fromkeys(file for mutant in mutants for file in files_of_tests(mutant.file)))
        trees.put(tree)
        with ThreadPoolExecutor(processes) as pool:
            return list(pool.map(attempt, mutants))


# ---- the command


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+", metavar="PATH")
    parser.add_argument("--sample", type=int, metavar="N")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=1, metavar="N")
    return parser.parse_args()


def main() -> int:
    """Returns the exit code: 0 if enough mutants of every path were killed."""
    options = _arguments()
    known = equivalents()
    chosen: dict[str, list[Mutant]] = {}
    left_out: dict[str, int] = {}
    try:
        for path in options.paths:
            mutants = mutants_below(path.rstrip("/"))
            fewer = options.sample is not None and options.sample < len(mutants)
            drawn = Random(options.seed).sample(mutants, options.sample) if fewer else mutants
            chosen[path] = [mutant for mutant in drawn if mutant.identity not in known]
            left_out[path] = len(drawn) - len(chosen[path])
        begun = time.monotonic()
        every = [mutant for mutants in chosen.values() for mutant in mutants]
        ended = {each.mutant: each for each in run_all(every, options.processes)}
    except MutationError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"\n{len(ended)} mutants in {time.monotonic() - begun:.0f} s")
    enough = True
    for path, mutants in chosen.items():
        endings = [ended[mutant] for mutant in mutants if mutant in ended]
        killed = sum(not each.lives for each in endings)
        timed_out = sum(each.ending == "timed out" for each in endings)
        share = killed / len(endings) if endings else 1.0
        enough &= share >= TARGET
        print(
            f"{path:<24} {killed} of {len(endings)} killed ({share:.0%}), {timed_out} of them by the time limit; "
            f"{left_out[path]} more are equivalent"
        )
    return 0 if enough else 1


if __name__ == "__main__":
    sys.exit(main())
