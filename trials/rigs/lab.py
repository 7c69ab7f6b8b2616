"""Writes what a lab would have of a rig: records as CSV, and a machine file as it would write it. Neither contains the
truth."""

from __future__ import annotations

import math

import numpy as np

from trials.rigs.drawing import generator
from trials.rigs.engine import Motion
from trials.rigs.kinds import CURRENT
from trials.rigs.parameters import BOARD, CASCADE
from trials.rigs.rig import Rig, Tolerance

SPEED_NOISE = 0.002
"""Noise of recorded speeds over the record's own speed."""


def records_text(rig: Rig, motion: Motion, name: str) -> str:
    """Returns the record as CSV: time, and the signals of its kind for every joint."""
    columns: list[tuple[str, np.ndarray]] = []
    for j in range(rig.kind.joints):
        columns.append((f"position_{j + 1}", motion.position[:, j]))
        if "set_point" in rig.kind.recorded:
            columns.append((f"set_point_{j + 1}", motion.set_point[:, j]))
        if "drive" in rig.kind.recorded:
            columns.append((f"drive_{j + 1}", motion.drive[:, j]))
        if "velocity" in rig.kind.recorded:
            draw = generator(rig.kind_name, rig.seed, f"speeds of {name}, joint {j}")
            speed = motion.velocity[:, j] + SPEED_NOISE * rig.speed * draw.standard_normal(motion.time.size)
            columns.append((f"velocity_{j + 1}", speed))
    header = ",".join(["time", *(title for title, _ in columns)])
    rows = np.column_stack([motion.time, *(values for _, values in columns)])
    return header + "\n" + "\n".join(",".join(f"{value:.12g}" for value in row) for row in rows) + "\n"


def beside_text(rig: Rig) -> str:
    """Returns the TOML beside a record: data that its columns cannot hold."""
    unit = "N·m" if rig.kind.drive == CURRENT else "V"
    return (
        f'robot = "{_name(rig)}"\nperiod = {float(rig.loop["period"][0])!r}\ndrive_unit = "{unit}"\n'
        "created = 2026-01-01T00:00:00Z\n"
    )


def machine_text(rig: Rig) -> str:
    """Returns the machine file: the healthy rig with every stated value wrong by its tolerance."""
    stated = {(t.name, t.joint): t for t in rig.tolerances}
    lines = [
        *("version = 1", f'name = "{_name(rig)}"', f'title = "Rig {rig.seed} of {rig.kind_name}"'),
        f"gravity = [{', '.join(repr(g) for g in rig.sound.gravity)}]",
        f"modelled_joints = {list(range(1, rig.kind.joints + 1))}",
    ]
    if rig.sound.load > 0:
        lines.append(f"load = {_exact(rig.sound.load, 'kg', 'scales')}")
    lines += [f"controller = {_controller(rig, stated)}", ""]
    if rig.kind.known_loop and (rig.kind.rounding or rig.kind.limit):
        limit, step = rig.sound_joints["limit"], rig.sound_joints["resolution"]
        lines.insert(0, f"# The controller's output: limits {list(map(float, limit))}, steps {list(map(float, step))}.")
    for j in range(rig.kind.joints):
        lines += _joint(rig, j, stated)
    return "\n".join(lines) + "\n"


def _name(rig: Rig) -> str:
    return f"{rig.kind_name}-{rig.seed}"


def _exact(value: float, unit: str, source: str) -> str:
    return f'{{ value = {float(value)!r}, unit = "{unit}", source = "{source}" }}'


def _off(true: float, tolerance: Tolerance | None, unit: str, source: str, low: float | None = 0.0) -> str:
    """Returns a value as the file states it: wrong by its tolerance, with the deviation."""
    if tolerance is None:
        return _exact(true, unit, source)
    value = float(true) * tolerance.factor
    bound = "" if low is None else f", low = {low!r}"
    deviation = abs(tolerance.share * value)
    return f'{{ value = {value!r}, unit = "{unit}", source = "{source}"{bound}, deviation = {deviation!r} }}'


Stated = dict[tuple[str, int | None], Tolerance]


def _controller(rig: Rig, stated: Stated) -> str:
    if not rig.kind.known_loop:
        return '{ kind = "none" }'
    period = _exact(float(rig.loop["period"][0]), "s", "controller's manual")
    delay = _off(float(rig.loop["delay"][0]), stated.get(("delay", None)), "s", "measured roughly")
    joints = rig.sound_joints
    if rig.kind.controller == BOARD:
        gains = [[int(p["p"]), int(p["i"]), int(p["d"])] for p in joints]
        scale = _exact(float(joints["dac_scale"][0]), "1", "manual")
        return (
            f'{{ kind = "board_pid", period = {period}, delay = {delay}, dac_counts_per_adc_count = {scale}, '
            f"gains = {gains} }}"
        )
    gains = [[float(p["p"]), float(p["i"]), float(p["d"])] for p in joints]
    inner = ""
    if rig.kind.controller == CASCADE:
        inner = f", velocity_gains = {[[float(p['inner_p']), float(p['inner_i']), 0.0] for p in joints]}"
    return f'{{ kind = "pid", period = {period}, delay = {delay}, gains = {gains}{inner} }}'


def _joint(rig: Rig, j: int, stated: Stated) -> list[str]:
    p, link = rig.sound_joints[j], rig.sound.links[j]
    of = {name: t for (name, joint), t in stated.items() if joint == j}
    geometry = ", ".join(
        f"{name} = {_exact(getattr(link, name), unit, 'drawing')}"
        for name, unit in (("a", "m"), ("alpha", "rad"), ("d", "m"), ("theta", "rad"))
    )
    friction = [f"viscous = {_off(p['viscous'], of.get('viscous'), 'N·m·s/rad', 'like others')}"]
    if p["coulomb"]:
        friction.append(f"coulomb = {_off(p['coulomb'], of.get('coulomb'), 'N·m', 'like others')}")
    span = _exact(p["range"], "rad", "encoder")
    bits = round(math.log2(p["range"] / p["count"]))
    noise = f", noise = {_exact(rig.kind.noise, 'count', 'at rest')}" if rig.kind.noise else ""
    return [
        *("[[joints]]", f'name = "axis_{j + 1}"', 'kind = "revolute"', f"geometry = {{ {geometry} }}"),
        f"link = {_link(rig, j, of)}",
        f"drive = {_drive(rig, j, of)}",
        f"friction = {{ {', '.join(friction)} }}",
        f"sensor = {{ bits = {bits}, range = {span}, at_zero = {_exact(p['at_zero'], 'rad', 'encoder')}{noise} }}",
        "",
    ]


def _link(rig: Rig, j: int, of: dict[str, Tolerance]) -> str:
    link = rig.sound.links[j]
    mass = _off(link.mass, of.get("mass"), "kg", "scales, without cables")
    if link.a == 0.0 and j == 0:
        radius = math.sqrt(2 * link.inertia[2] / link.mass)
        return f'{{ shape = "cylinder", mass = {mass}, radius = {_exact(radius, "m", "drawing")} }}'
    if link.a > 0.0 and not rig.kind.body:
        return f'{{ shape = "rod", mass = {mass} }}'
    centre = [
        _off(link.centre[0], of.get("centre"), "m", "drawing", None),
        *(_exact(c, "m", "drawing") for c in link.centre[1:]),
    ]
    # MuJoCo's bodies keep their inertia about the centre when a mass is stated wrongly; so does the file.
    about = [_off(value, of.get("inertia"), "kg·m²", "drawing") for value in link.inertia]
    about += [_exact(0.0, "kg·m²", "symmetry")] * 3
    return f'{{ shape = "body", mass = {mass}, centre = [{", ".join(centre)}], inertia = [{", ".join(about)}] }}'


def _drive(rig: Rig, j: int, of: dict[str, Tolerance]) -> str:
    p = rig.sound_joints[j]
    if rig.kind.drive == CURRENT:
        gain = _exact(1.0, "N·m/(N·m)", "torque at the joint is recorded")
        rotor = _off(p["rotor"], of.get("rotor"), "kg·m²", "data sheet")
        return f'{{ kind = "gain", gain = {gain}, inertia = {rotor} }}'
    magnet = of.get("magnet")
    values = {
        "resistance": _off(p["resistance"], of.get("resistance"), "Ω", "data sheet", 1e-3),
        "inductance": _exact(p["inductance"], "H", "data sheet"),
        "torque_constant": _off(p["torque_constant"], magnet, "N·m/A", "data sheet", 1e-6),
        "back_emf_constant": _off(p["back_emf"], magnet, "V·s/rad", "data sheet"),
        "rotor_inertia": _off(p["rotor"] / p["gear"] ** 2, of.get("rotor"), "kg·m²", "data sheet"),
        "gear_ratio": _exact(p["gear"], "1", "data sheet"),
        "amplifier_gain": _exact(1.0, "1", "volts at the motor are recorded"),
        "dac_full_scale": _exact(rig.highest, "V", "supply"),
        "supply_limit": _exact(rig.highest, "V", "supply"),
    }
    return f'{{ kind = "dc_motor", {", ".join(f"{name} = {value}" for name, value in values.items())} }}'
