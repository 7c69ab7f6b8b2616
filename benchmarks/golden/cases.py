"""Questions: arms, rigs and the commands whose answers are compared with the recorded ones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples"

SINGLES = (
    "viscous_friction:joint=2,coefficient=6",
    "coulomb_friction:joint=1,torque=3",
    "load_dependent_friction:joint=2,arm=0.12",
    "stribeck_friction:joint=3,torque=2.5",
    "stiction:joint=3,breakaway=3",
    "direction_dependent_friction:joint=1,torque=2",
    "weakened_magnet:joint=2,loss=0.3",
    "resistance_drift:joint=2,thermal_resistance=40",
    "motor_inductance:joint=1,inductance=0.02",
    "dead_zone:joint=2,width=1.5",
    "supply_limit:joint=2,reduction=14",
    "torque_ripple:joint=1,amplitude=1.5,periods=42",
    "gear_loss:joint=2,loss=0.25",
    "backlash:joint=2,play=0.02",
    "joint_compliance:joint=3,compliance=0.004",
    "payload:mass=0.6",
    "link_mass:joint=3,mass=0.25",
    "centre_of_mass:joint=2,shift=0.06",
    "base_tilt:about_x=0.08",
    "spring_torque:joint=2,stiffness=8",
    "periodic_disturbance:joint=2,amplitude=1.5,frequency=3",
    "potentiometer_gain:joint=1,error=0.04",
    "potentiometer_offset:joint=2,angle=0.06",
    "potentiometer_nonlinearity:joint=3,loading=0.08",
    "input_delay:joint=2,delay=0.008",
    "wrong_gain:joint=1,factor=1.5",
    "lost_set_points:joint=3,share=0.05",
)
"""One hidden effect of every kind that the diagnosis knows, in the form of the mock's `--modify`."""
SECOND_SINGLES = (
    "coulomb_friction:joint=3,torque=1.5",
    "stiction:joint=1,breakaway=4",
    "dead_zone:joint=1,width=2.5",
    "backlash:joint=3,play=0.01",
    "torque_ripple:joint=2,amplitude=2,periods=20",
    "weakened_magnet:joint=1,loss=0.2",
    "payload:mass=-0.4",
    "input_delay:joint=1,delay=0.012",
)
PAIRS = (
    ("coulomb_friction:joint=1,torque=3", "payload:mass=0.5"),
    ("backlash:joint=2,play=0.02", "dead_zone:joint=1,width=2"),
    ("torque_ripple:joint=1,amplitude=1.5,periods=42", "viscous_friction:joint=3,coefficient=3"),
    ("wrong_gain:joint=1,factor=1.4", "coulomb_friction:joint=2,torque=4"),
    ("spring_torque:joint=2,stiffness=8", "stiction:joint=3,breakaway=3"),
    ("lost_set_points:joint=2,share=0.05", "potentiometer_gain:joint=3,error=0.04"),
)
OPEN_SET = (
    "tight_spot:joint=2,coefficient=40,centre=0.9",
    "quadratic_drag:joint=1,coefficient=8",
    "cable_hysteresis:joint=1,torque=3",
    "ageing_friction:joint=3,torque=1.5",
    "amplifier_slew_rate:joint=1,time_per_volt=0.004",
    "drive_coupling:joint=1,share=0.2,onto=2",
    "potentiometer_zero_drift:joint=2,drift=0.03",
    "stuck_converter_bit:joint=1,bit=3",
)
"""Hidden effects that the diagnosis does not know."""
SECRET_ARMS = (110, 210, 310, 410, 510, 610, 150, 250, 160, 260, 311, 412)
"""Arms with drawn tolerances: healthy ones, effects shared by joints, wrong priors, announced loads."""

FITS = (
    ("secret-110", ()),
    ("secret-210", ("--no-priors", "--parameters", "*.mass,*.resistance")),
    ("single-coulomb_friction-1", ("--effects", "viscous,load_dependent,coulomb:1")),
    ("single-payload-15", ("--open-loop",)),
    ("secret-310", ("--method", "nelder_mead", "--parameters", "load.mass,link2.mass")),
    ("single-weakened_magnet-6", ("--starts", "3", "--seed", "5")),
    ("secret-410", ("--torques",)),
)
"""Arms, and how a model is fitted to their traces."""
VALIDATIONS = (
    (),
    ("--joint", "2"),
    ("--parameters", "*.mass,*.resistance"),
    ("--damping-ratio", "0.7"),
    ("--joint", "1", "--joint", "3"),
    (),
    (),
)
SIMULATIONS = ((), ("--open-loop",), ("--no-rounding",), (), (), ("--open-loop", "--no-rounding"), ())
DESIGNS = (
    ("ma2000", "--experiments", "2", "--duration", "4", "--candidates", "12"),
    ("ma2000", "--parameters", "*.mass", "--experiments", "1", "--duration", "6", "--candidates", "8", "--seed", "3"),
    ("ma2000", "--parameters", "joint2.*", "--experiments", "2", "--duration", "5", "--candidates", "10"),
    ("ma2000", "--experiments", "1", "--duration", "3", "--candidates", "6", "--seed", "2"),
    ("ma2000", "--parameters", "joint1.*", "--experiments", "2", "--duration", "4", "--candidates", "8"),
)
COMPARISONS = (
    ("ma2000", "models/0.json", "traces/secret-110/held-out.mcap"),
    ("ma2000", "models/1.json", "traces/secret-210/fitted.mcap", "traces/secret-210/held-out.mcap"),
    ("models/0.json", "models/1.json", "traces/secret-310/held-out.mcap"),
    ("ma2000", "models/2.json", "models/3.json", "traces/single-coulomb_friction-1/held-out.mcap"),
    ("models/4.json", "models/5.json", "traces/secret-410/fitted.mcap"),
)
"""Models and traces; a word with a slash is one of the recorded or fitted files."""


@dataclass(frozen=True)
class Arm:
    """A mock arm. query: part of its port's URL. experiment: recorded on it and fitted to."""

    name: str
    query: str
    experiment: str = "ramp-step"
    options: tuple[str, ...] = ()


@dataclass(frozen=True)
class Rig:
    """A rig whose example script writes its records."""

    name: str
    script: str
    records: tuple[str, ...]
    model: str
    arguments: tuple[str, ...] = ()


RIGS = (
    Rig("bench", "motor_bench_rig.py", ("bench_1.csv", "bench_2.csv"), "motor_bench.toml"),
    Rig("axis", "linear_axis_rig.py", ("axis_1.csv", "axis_2.csv"), "linear_axis.toml"),
    Rig("single", "single_axis_rig.py", ("rig_1.csv", "rig_2.csv"), "single_axis.toml"),
    Rig("paddle", "single_axis_rig.py", ("rig_1.csv", "rig_2.csv"), "single_axis.toml", ("paddle",)),
)


def arms() -> tuple[Arm, ...]:
    """Returns all arms that are diagnosed: singles, pairs, open set, secret ones; a few on the long experiment."""
    found = [
        Arm(f"single-{_effect(text)}-{number}", _modify(text))
        for number, text in enumerate((*SINGLES, *SECOND_SINGLES))
    ]
    found += [Arm(f"pair-{number}", _modify(*pair)) for number, pair in enumerate(PAIRS)]
    found += [Arm(f"open-{_effect(text)}", _modify(text)) for text in OPEN_SET]
    found += [Arm(f"secret-{seed}", f"secret={seed}") for seed in SECRET_ARMS]
    found += [
        Arm("long-coulomb", _modify("coulomb_friction:joint=2,torque=3"), "diagnostic", ("--joints", "2-3")),
        Arm("long-sound", "secret=710", "diagnostic", ("--effects", "backlash,coulomb_friction,torque_ripple,payload")),
    ]
    return tuple(found)


def _effect(text: str) -> str:
    return text.partition(":")[0]


def _modify(*texts: str) -> str:
    return "&".join(f"modify={text}" for text in texts)


@dataclass(frozen=True)
class Question:
    """A command whose answer is recorded. words: its arguments, after `daq`."""

    name: str
    words: tuple[str, ...]


def questions(place: Path) -> list[Question]:
    """Returns every command, on the records in `place`, which `records.make` has written."""
    return [*_diagnoses(place), *_models(place), *_small(place)]


def _traces(place: Path, arm: Arm) -> tuple[str, str]:
    """Returns the trace that an arm is fitted to and the held-out one."""
    folder = place / "traces" / arm.name
    return str(folder / "fitted.mcap"), str(folder / "held-out.mcap")


def _diagnoses(place: Path) -> list[Question]:
    found = []
    for arm in arms():
        fitted, held_out = _traces(place, arm)
        held = () if arm.experiment != "ramp-step" else ("--holdout", held_out)
        found.append(Question(f"diagnose/{arm.name}", ("diagnose", fitted, *held, "--json", *arm.options)))
    for rig in RIGS:
        first, second = (str(place / "rigs" / rig.name / name) for name in rig.records)
        words = ("--model", str(EXAMPLES / rig.model), "--json")
        found.append(Question(f"diagnose/rig-{rig.name}", ("diagnose", first, "--holdout", second, *words)))
        found.append(Question(f"diagnose/rig-{rig.name}-turned", ("diagnose", second, "--holdout", first, *words)))
        found.append(Question(f"diagnose/rig-{rig.name}-both", ("diagnose", first, second, *words)))
    return found


def _models(place: Path) -> list[Question]:
    """Returns several each of `fit`, `validate`, `compare`, `design` and `simulate`."""
    found, by_name = [], {arm.name: arm for arm in arms()}
    made = place / "models"
    for number, (name, options) in enumerate(FITS):
        fitted, held_out = _traces(place, by_name[name])
        model = str(made / f"{number}.json")
        found.append(Question(f"fit/{number}-{name}", ("fit", fitted, "-o", model, "--json", *options)))
        found.append(
            Question(f"validate/{number}-{name}", ("validate", "ma2000", fitted, "--json", *VALIDATIONS[number]))
        )
        found.append(
            Question(f"simulate/{number}-{name}", ("simulate", "ma2000", held_out, "--json", *SIMULATIONS[number]))
        )
    for rig in RIGS[1:2]:
        first, second = (str(place / "rigs" / rig.name / record) for record in rig.records)
        model = str(EXAMPLES / rig.model)
        out = str(made / f"{rig.name}.json")
        found.append(
            Question(
                f"fit/rig-{rig.name}",
                ("fit", first, "--torques", "--model", model, "--holdout", second, "-o", out, "--json"),
            )
        )
    for number, options in enumerate(DESIGNS):
        found.append(Question(f"design/{number}", ("design", *options, "--json")))
    fitted, held_out = _traces(place, by_name[FITS[0][0]])
    for number, options in enumerate(COMPARISONS):
        files = tuple(str(place / word) if "/" in word else word for word in options)
        found.append(Question(f"compare/{number}", ("compare", *files, "--json")))
    return found


def _small(place: Path) -> list[Question]:
    """Returns quick commands, most of which read from a mock in lock-step."""
    fitted, _ = _traces(place, arms()[0])
    mock = ("--port", "mock://?lock_step=1")
    return [
        Question("small/status", (*mock, "status", "--json")),
        Question("small/run-dry", (*mock, "run", "ramp", "--joints", "1-3", "--dry-run", "--json")),
        Question(
            "small/run",
            (*mock, "run", "ramp", "--joints", "1-3", "--yes", "--json", "--folder", str(place / "scratch")),
        ),
        Question("small/traces-show", ("traces", "show", fitted, "--json")),
        Question("small/traces-verify", ("traces", "verify", fitted, "--json")),
        Question("small/traces-ls", ("traces", "ls", "--folder", str(place / "traces" / arms()[0].name), "--json")),
        Question("small/config", ("config", "show", "--json")),
        Question("small/thesis", ("thesis", "--json")),
    ]
