"""Every effect of the library at a size that shows, beside the same effect in continuous time."""

from dataclasses import dataclass

import numpy as np

from daq.contracts.machine import load_machine
from model.arrays import Floats
from model.effects.library import library
from model.machine_model.model import Model, base_model
from model.simulation.inputs import RunInputs, inputs_of
from model.simulation.prepared import Options, prepare
from model.simulation.simulate import simulate
from tests.model.simulation import continuous_time
from tests.model.simulation.records import PERIOD, START, trace_of

COUNT = 1.5 * np.pi / 4096
"""rad."""


@dataclass(frozen=True)
class Case:
    """An effect on a joint (the whole machine where it belongs to that), with values; three sizes, one a joint."""

    effect: str
    values: tuple[dict[str, float], ...]
    shown_on: int

    def model(self, base: Model, joint: int) -> Model:
        """The base model with the effect; where it has it already, with more of it."""
        values = self.values[min(joint, len(self.values)) - 1]
        if any(use.name == self.effect for use in base.effects):
            return base.with_values({f"joint{joint}.{self.effect}.{n}": v for n, v in values.items()})
        return base.with_effect(self.effect, () if library()[self.effect].whole_machine else (joint,), values)


def _of(effect: str, name: str, sizes: tuple[float, float, float], shown_on: int, **also: float) -> Case:
    return Case(effect, tuple({name: size, **also} for size in sizes), shown_on)


CASES = (
    _of("viscous_friction", "coefficient", (2e-5, 1.2e-4, 1.2e-4), 3),
    _of("quadratic_drag", "coefficient", (4.0, 6.0, -1.0), 1),
    _of("coulomb_friction", "torque", (1.2, 2.5, 0.5), 1),
    _of("load_dependent_friction", "arm", (0.4, 0.4, 0.4), 2),
    _of("gravity_torque_friction", "share", (0.2, 0.2, 0.2), 2),
    _of("stribeck_friction", "torque", (1.4, 2.4, 0.6), 2, speed=0.2),
    _of("stiction", "breakaway", (3.0, 3.6, 1.7), 2),
    _of("direction_dependent_friction", "difference", (0.6, 2.7, 0.7), 3),
    _of("direction_dependent_viscous_friction", "difference", (-2e-5, 1.2e-4, -1.2e-4), 3),
    _of("weakened_magnet", "loss", (0.2, 0.2, 0.2), 1),
    _of("resistance_drift", "heating", (0.2, 0.05, 0.2), 2, time_constant=10.0),
    _of("resistance_rise", "rise", (0.5, 0.5, 0.5), 2, time_constant=1.0),
    _of("motor_inductance", "inductance", (0.017, 0.042, 0.014), 1),
    _of("dead_zone", "width", (0.5, 0.7, 0.5), 3),
    _of("amplifier_threshold", "width", (2.5, 1.5, 1.0), 3),
    _of("supply_limit", "voltage", (14.0, 24.0, 9.0), 2),
    _of("torque_ripple", "sine", (0.6, 1.5, 0.4), 1, cosine=0.1, cycles=24.0),
    _of("gear_loss", "loss", (0.12, 0.19, 0.11), 3),
    _of("direction_dependent_gear_loss", "difference", (0.12, -0.19, 0.11), 3),
    _of("backlash", "gap", (0.004, 0.0067, 0.006), 1),
    _of("joint_compliance", "compliance", (2.5e-4, 3.5e-4, 1.2e-3), 2),
    Case("payload", ({"mass": 0.55},), 2),
    _of("link_mass", "added", (10.0, 0.9, 0.6), 3),
    _of("centre_of_mass", "shift", (0.03, 0.14, 0.08), 3),
    Case("base_tilt", ({"about_y": 0.15, "about_x": 0.05},), 2),
    _of("spring_torque", "stiffness", (1.5, 5.0, 1.5), 1, rest=0.5),
    Case(
        "one_sided_spring", tuple({"stiffness": k, "rest": q + 0.1} for k, q in zip((9, -40, 9), START, strict=True)), 1
    ),
    _of("constant_torque", "torque", (0.6, -1.8, 0.4), 2),
    _of("periodic_disturbance", "sine", (0.6, 1.8, 0.4), 2, cosine=0.3, frequency=2.0),
    _of("potentiometer_gain", "relative", (0.06, 0.06, 0.06), 2),
    _of("potentiometer_offset", "offset", (0.067, 0.067, 0.067), 3),
    _of("potentiometer_nonlinearity", "bend_1", (0.02, 0.02, 0.02), 1, bend_2=-0.01),
    _of("input_delay", "time", (0.006, 0.0134, 0.004), 2),
    _of("wrong_gain", "relative", (0.12, 0.09, 0.13), 3),
    _of("lost_set_points", "share", (0.06, 0.06, 0.06), 1),
)


def everything(base: Model, left_out: tuple[str, ...]) -> Model:
    """All other effects on every joint, at the sizes of their cases. The waist's centre of mass stays on its axis: the
    closed form knows no other place, and the recursive form does."""
    model = base
    for case in (case for case in CASES if case.effect not in left_out):
        if library()[case.effect].whole_machine:
            model = model.with_effect(case.effect, (), case.values[0])
            continue
        if not any(use.name == case.effect for use in base.effects):
            model = model.with_effect(case.effect, (1, 2, 3))
        sizes = {(joint, name): value for joint in (1, 2, 3) for name, value in case.values[joint - 1].items()}
        model = model.with_values({f"joint{j}.{case.effect}.{name}": value for (j, name), value in sizes.items()})
    return model.with_values({"joint1.centre_of_mass.shift": 0.0})


class Bench:
    """The arm on a ramp up and down, with an effect and without, simulated and in continuous time.

    Args:
        seconds: of the record. exact_step: of the continuous-time integration, s.
    """

    def __init__(self, seconds: float, exact_step: float) -> None:
        self.base = base_model(load_machine("ma2000"))
        self.inputs = _ramp_and_back(self.base, seconds)
        self.exact_step = exact_step
        self._exact_base = self.exact(self.base)

    def exact(self, model: Model) -> Floats:
        """Readings (k, 3), rad, in continuous time."""
        counts = prepare(model, self.inputs, Options(quantise=False)).set_points
        return continuous_time.readings(model, counts, self.inputs.initial[:, 0], self.exact_step)

    def measure(self, model: Model, steps: tuple[float, ...]) -> tuple[float, dict[float, float], dict[float, float]]:
        """The effect's own size, and by step the largest error of a reading, and that of the difference which the
        effect makes; all in counts."""
        exact = self.exact(model)
        size = np.abs(exact - self._exact_base).max() / COUNT
        errors, differences = {}, {}
        for step in steps:
            options = Options(quantise=False, step=step)
            run = simulate(model, self.inputs, options).reading
            without = simulate(self.base, self.inputs, options).reading
            errors[step] = float(np.abs(run - exact).max() / COUNT)
            differences[step] = float(np.abs(run - without - exact + self._exact_base).max() / COUNT)
        return float(size), errors, differences


def _ramp_and_back(model: Model, seconds: float) -> RunInputs:
    """21.6° at the source's speed of 33°/s and back, as far as the time goes, after a tenth of a second at rest."""
    time = PERIOD * np.arange(round(seconds / PERIOD))
    rise = np.radians(33.2) * np.clip(time - 0.1, 0.0, 0.45 * seconds)
    back = np.radians(33.2) * np.clip(time - 0.1 - 0.45 * seconds, 0.0, None)
    wanted = np.array(START) + (rise - back)[:, None]
    own = [model.machine.calibration(j) for j in (1, 2, 3)]
    rounded = [[c.posture_to_rad(c.rad_to_posture(x)) for c, x in zip(own, row, strict=True)] for row in wanted]
    return inputs_of(trace_of(np.array(rounded)), model.machine)
