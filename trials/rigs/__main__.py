"""Writes the folder of one rig: `lab/` for the diagnosis, `truth.json` for its judge.

    python -m trials.rigs FOLDER --kind K --seed N [--case CASE] [--effect NAME] [--sharpness]
    python -m trials.rigs --list

`lab/` holds machine.toml, training.csv and held_out.csv, each record with the TOML that says what columns cannot.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from trials.rigs.folder import write_rig
from trials.rigs.hiding import DRAWN
from trials.rigs.kinds import KINDS, REPORTING
from trials.rigs.recorded_rig import CASES


def main(arguments: list[str]) -> int:
    """Writes the folder; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m trials.rigs", description="Writes the folder of one rig.")
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--kind", choices=tuple(KINDS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--case", choices=CASES, help="instead of the seed's own")
    parser.add_argument(
        "--effect", choices=DRAWN, metavar="NAME", help="hide this one (a name of the library), whatever the case"
    )
    parser.add_argument("--sharpness", action="store_true", help="also which laws the records can distinguish")
    parser.add_argument("--list", action="store_true", help="the kinds")
    asked = parser.parse_args(arguments)
    if asked.list:
        for name, kind in KINDS.items():
            print(f"{name:<18} {'reporting' if name in REPORTING else 'tuning':<10} {kind.joints} joints")
        return 0
    if asked.folder is None or asked.kind is None:
        parser.error("FOLDER and --kind are needed")
    for path in write_rig(asked.folder, asked.kind, asked.seed, asked.case, asked.effect, sharp=asked.sharpness):
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
