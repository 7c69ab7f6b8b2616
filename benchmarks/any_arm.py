"""Walks of a new user: public records of six arms, from the file to a verdict.

python -m benchmarks any_arm --data FOLDER            each record: lines written, processor time, verdict or stop
python -m benchmarks any_arm --data FOLDER --fetch    the same; repositories that FOLDER lacks are cloned first
python -m benchmarks any_arm --data FOLDER --python   the same calls by `import ma2000`

Exit code 1 where a record has no verdict, or needs more than 15 lines or 10 minutes. `any_arm.toml` has the records.
"""

from __future__ import annotations

import argparse
import resource
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from benchmarks.figures import machine
from benchmarks.real_machines.records import MissingDataError, content, find_repository
from extras.formats.bags.joint_messages import JOINT_STATE

MOST_LINES, MOST_MINUTES = 15, 10.0
BAG_BEGINS = 1_700_000_000 * 10**9
"""ns since 1970 at which a bag begins that is written from tables, whose times begin at 0."""
COMMAND = "from daq_cli import main; main()"
IN_PYTHON = """
import ast, sys, ma2000
given, parts, model = ast.literal_eval(sys.argv[1])
traces = [ma2000.read_trace(file, where=where or None, **given) for file, where in parts]
print(ma2000.diagnose(ma2000.load_machine(model), traces[:1], traces[1:]).summary)
"""


def repository_of(record: dict[str, Any], data: Path, *, clone: bool) -> Path:
    """Returns a record's repository below `data`, which is cloned if it is missing. Raises MissingDataError."""
    try:
        return find_repository(data, record["repository"])
    except MissingDataError:
        if not clone:
            raise
    place = data / f"{record['repository'].partition('/')[2]}.git"
    words = ["git", "clone", "--bare", f"https://github.com/{record['repository']}", str(place)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        raise MissingDataError(f"{' '.join(words)}: {done.stderr.strip().splitlines()[-1]}")
    return place


def lay_out(record: dict[str, Any], repository: Path, place: Path) -> None:
    """Writes a record's files and machine file below `place`. Raises MissingDataError."""
    for name, inside in record["files"].items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_bytes(content(repository, record["commit"], inside))
    if "machine" in record:
        (place / "machine.toml").write_text(record["machine"], encoding="utf-8")
    if "bag" in record:
        write_bag({signal: place / name for signal, name in record["bag"].items()}, place / record["import"])


def write_bag(tables: dict[str, Path], place: Path) -> None:
    """Writes tables of `position`, `velocity` and `effort` as a bag of ROS 2 with sensor_msgs/JointState, by ROS's own
    definitions. Their columns are times (s) and `- JOINT_SIGNAL`.
    """
    rows = {signal: np.genfromtxt(path, delimiter=",", skip_header=1) for signal, path in tables.items()}
    head = tables["position"].read_text("utf-8").partition("\n")[0].split(",")[1:]
    names = [one.strip().removeprefix("- ").removesuffix("_position") for one in head]
    store = get_typestore(Stores.ROS2_HUMBLE)
    state, header, stamp = (
        store.types[one] for one in (JOINT_STATE, "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    with Writer(place, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/joint_states", JOINT_STATE, typestore=store)
        for k, time in enumerate(rows["position"][:, 0]):
            seconds, rest = divmod(BAG_BEGINS + round(1e9 * time), 10**9)
            signals = {signal: table[k, 1:] for signal, table in rows.items()}
            message = state(header=header(stamp=stamp(sec=seconds, nanosec=rest), frame_id=""), name=names, **signals)
            writer.write(topic, seconds * 10**9 + rest, store.serialize_cdr(message, JOINT_STATE))


def steps(record: dict[str, Any], parts: Sequence[tuple[str, str]], model: str) -> list[list[str]]:
    """Returns the commands from the file to a verdict; `#0` stands for the first imported trace, `#1` for the next."""
    options = [word for key, text in record.get("map", {}).items() for word in ("--map", f"{key}={text}")]
    options += ["--drive-unit", record["drive_unit"]] if "drive_unit" in record else []
    imports = []
    for k, (file, where) in enumerate(parts):
        known = file in dict(parts[:k])  # the answers are kept beside the file
        imports.append(["traces", "import", file, *([] if known else options), *(["--where", where] if where else [])])
    new = [["machine", "new", *shlex.split(record["new"])]] if "new" in record else []
    ends = (["check", "#0"], ["diagnose", "#0", "--holdout", "#1", *record.get("asked", [])])
    return [*imports, *new, *([*words, "--model", model] for words in ends)]


def walk(record: dict[str, Any], data: Path, *, python: bool, clone: bool) -> tuple[int, float, str, bool]:
    """Returns the lines written, minutes of the processor, the verdict or what stopped it, and whether there is one."""
    parts = [(record["import"], where) for where in record["take"]] if "take" in record else []
    parts = parts or [(name, "") for name in record["files"]]
    model = record.get("model", "machine.toml")
    commands = steps(record, parts, model)
    lines = len(commands) + sum(bool(line.strip()) for line in record.get("machine", "").splitlines())
    programs = [[COMMAND, *words] for words in commands]
    if python:
        given = {key: record[key] for key in ("map", "drive_unit") if key in record}
        programs = [p for p in programs if p[1] == "machine"] + [[IN_PYTHON, repr((given, parts, model))]]
        lines = IN_PYTHON.count("\n") - 1
    begun, traces, said = resource.getrusage(resource.RUSAGE_CHILDREN), list[str](), ""
    with TemporaryDirectory() as folder:
        lay_out(record, repository_of(record, data, clone=clone), Path(folder))
        for program, *words in programs:
            filled = [traces[int(word[1:])] if word in ("#0", "#1") else word for word in words]
            call = [sys.executable, "-c", program, *filled]
            done = subprocess.run(call, cwd=folder, capture_output=True, text=True, check=False)
            told = (done.stderr if done.returncode else done.stdout).strip().splitlines() or [""]
            said = told[-1 if done.returncode else 0].strip()
            traces.append(said)
            if done.returncode:
                break
    now = resource.getrusage(resource.RUSAGE_CHILDREN)
    minutes = (now.ru_utime + now.ru_stime - begun.ru_utime - begun.ru_stime) / 60.0
    return lines, minutes, said, not done.returncode


def main(arguments: Sequence[str] | None = None) -> int:
    """Prints the table; returns 1 if a record has no verdict or needs too much. Raises MissingDataError."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder of repositories")
    parser.add_argument("--fetch", action="store_true", help="clone what is missing")
    parser.add_argument("--python", action="store_true", help="by `import ma2000`, not by commands")
    parser.add_argument("--only", default="", metavar="NAME", help="beginning of a record's name")
    options = parser.parse_args(arguments)
    records = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))["record"]
    good = True
    for record in [one for one in records if one["what"].startswith(options.only)]:
        lines, minutes, said, ended = walk(record, options.data, python=options.python, clone=options.fetch)
        print(f"| {record['what']} | {lines} | {minutes:.1f} | {said} |", flush=True)
        good = good and ended and lines <= MOST_LINES and minutes <= MOST_MINUTES
    print(f"[{machine()}]")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
