"""Measures repeatability: runs the same ramp repeatedly through the service, and reports the spread between runs.

    python examples/repeatability.py http://127.0.0.1:8300 --runs 5 --folder traces

For a service elsewhere, put its token into DAQ_TOKEN. The traces are fetched into the folder, and stay at the service
with the tag `repeatability`.
"""

import argparse
import os
import statistics
from pathlib import Path

from daq.client import Client, Robot
from daq.contracts.experiment import ExperimentSpec, Ramp


def run_once(robot: Robot, spec: ExperimentSpec, folder: Path) -> dict[int, float]:
    """Does one run; returns the overshoot in degrees by joint. Raises SystemExit if it was not completed."""
    ended = robot.experiments.wait(robot.experiments.submit(spec).id)
    if ended.state != "done" or ended.trace is None:
        raise SystemExit(f"experiment {ended.id} {ended.state}: {ended.reason}")
    robot.traces.change(ended.trace, tags=["repeatability"])
    print(robot.traces.download(ended.trace, folder))
    figures = robot.traces.get(ended.trace).figures
    return {one.joint: one.overshoot for one in figures if one.moved and one.overshoot is not None}


def main(arguments: list[str] | None = None) -> None:
    """Runs the study, and prints mean and spread of the overshoot of every joint."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("url")
    options.add_argument("--runs", type=int, default=5)
    options.add_argument("--folder", type=Path, default=Path("traces"))
    chosen = options.parse_args(arguments)
    if chosen.runs < 2:
        options.error(f"--runs {chosen.runs}: the spread of runs needs at least 2")
    chosen.folder.mkdir(parents=True, exist_ok=True)
    spec = ExperimentSpec(trajectory=Ramp(amplitude=0.15, duration=0.4), joints=(1, 2, 3), hold=0.5, name="repeat")
    with Client(chosen.url, os.environ.get("DAQ_TOKEN")) as client:
        robot = client.robot()
        found = [run_once(robot, spec, chosen.folder) for _ in range(chosen.runs)]
    for joint in sorted(set.intersection(*(set(one) for one in found))):
        values = [one[joint] for one in found]
        print(f"joint {joint}: overshoot {statistics.mean(values):.2f}° ± {statistics.stdev(values):.3f}°")


if __name__ == "__main__":
    main()
