"""Tables 5.1 to 5.3 and 7.1 to 7.10 of the thesis as data. Symbols as printed, values in SI units.

It also builds the models of chapter 7 with published or initial values, and recomputes Σλ² from the published tables,
in both conventions of τ′.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from daq.contracts.frozen import FrozenRecord
from daq.contracts.machine import Machine
from extras.thesis.driven_arm import DrivenArm
from model.dynamics.rod_arm import RodArm
from model.machine_model.model import Model, base_model
from model.validation.criterion import contribution
from model.validation.expected_deviation import Basis, Convention, deviation_share


@dataclass(frozen=True)
class Symbol:
    """A parameter of chapter 7: its unit, its name in a model of the MA2000, and how its deviation is expected."""

    name: str
    unit: str
    parameter: str


SHARED_BACK_EMF = "joints1+3.motor.back_emf_constant"
"""Name of the back-EMF constant K_b1-3, which joints 1 and 3 share because they have the same motor."""

SYMBOLS = (
    Symbol("m1", "kg", "link1.mass"),
    Symbol("m2", "kg", "link2.mass"),
    Symbol("m3", "kg", "link3.mass"),
    Symbol("MLOAD", "kg", "load.mass"),
    Symbol("R1", "m", "link1.radius"),
    Symbol("A2", "m", "link2.length"),
    Symbol("A3", "m", "link3.length"),
    Symbol("Kb1-3", "V·s/rad", SHARED_BACK_EMF),
    Symbol("Kb2", "V·s/rad", "joint2.motor.back_emf_constant"),
    Symbol("v_eff1", "N·m·s/rad", "joint1.viscous_friction.coefficient"),
    Symbol("v_eff2", "N·m·s/rad", "joint2.viscous_friction.coefficient"),
    Symbol("v_eff3", "N·m·s/rad", "joint3.viscous_friction.coefficient"),
    Symbol("μ̃", "m", "joints1+2+3.load_dependent_friction.arm"),
)
"""All thirteen parameters, in the order of the tables."""

DATA_SHEET_BACK_EMF_2 = 0.0334
"""K_b of the Escap motor, V·s/rad (table 7.1)."""

RESISTANCE = (5.49, 4.5, 5.49)
TORQUE_CONSTANT = (0.0208, 0.033, 0.0208)
ROTOR_INERTIA = (18.3e-7, 32e-7, 18.3e-7)
GEAR = (600.0, 635.5, 1000.0 / 3.0)
"""Table 7.1 and appendix C: Ω, N·m/A, kg·m², motor turns per joint turn, joints 1 to 3. In SI units K_b of the Maxon
motors is their K_T, 0.0208 V·s/rad; the source starts at 0.030 instead."""


@dataclass(frozen=True)
class PublishedModel:
    """One column of chapter 7.

    Args:
        name: as used here. table, deviation_table: numbers of the tables.
        values: optimised parameters by symbol.
        deviations: standard deviations that would explain the residual; None where printed as very large.
        mean_squared_error: rad², summed over joints 1 to 3. sum_lambda: Σλ²; None for the unoptimised model.
    """

    name: str
    table: str
    deviation_table: str | None
    values: dict[str, float]
    deviations: dict[str, float | None]
    mean_squared_error: float
    sum_lambda: float | None

    @property
    def free(self) -> tuple[str, ...]:
        """Symbols that were fitted."""
        return tuple(s.name for s in SYMBOLS if s.name in self.values)

    def arm(self, *, published_inertia: bool = True) -> DrivenArm:
        """Returns the arm that the table describes."""
        v = self.values
        rotor = tuple(g * g * j for g, j in zip(GEAR, ROTOR_INERTIA, strict=True))
        links = (v["m1"], v["R1"], v["m2"], v["m3"], v["MLOAD"], v["A2"], v["A3"])
        body = RodArm(*links, rotor_inertia=(rotor[0], rotor[1], rotor[2]), published_inertia=published_inertia)
        body = replace(body, gravity=(0.0, 0.0, -9.81))
        back_emf = (v["Kb1-3"], v.get("Kb2", DATA_SHEET_BACK_EMF_2), v["Kb1-3"])
        arm = DrivenArm(body, RESISTANCE, TORQUE_CONSTANT, back_emf, GEAR)
        viscous = (v.get("v_eff1", 0.0), v.get("v_eff2", 0.0), v.get("v_eff3", 0.0))
        return replace(arm, viscous=viscous, friction_arm=v.get("μ̃", 0.0))


def _column(*values: float | None) -> dict[str, float | None]:
    return {symbol.name: value for symbol, value in zip(SYMBOLS, values, strict=False)}


def _values(*values: float) -> dict[str, float]:
    return {symbol.name: value for symbol, value in zip(SYMBOLS, values, strict=False)}


UNOPTIMISED = PublishedModel(
    "unoptimised", "7.2", None, _values(2.0468, 0.4040, 0.2321, 1.0, 0.0493, 0.23, 0.137, 0.03), {}, 2.1428e-3, None
)

BASIC = PublishedModel(
    name="basic",
    table="7.3",
    deviation_table="7.4",
    values=_values(2.93606, 1.22802, 0.64424, 1.11327, 0.05376, 0.89820, 0.32245, 0.03776),
    deviations=_column(None, 0.9342, 0.4001, 0.6560, None, 0.1674, 0.0557, 0.0263),
    mean_squared_error=1.4651e-3,
    sum_lambda=0.2449,
)

BASIC_WITH_BACK_EMF = PublishedModel(
    name="basic + Kb2",
    table="7.5",
    deviation_table="7.6",
    values=_values(2.050781, 0.401821, 0.229105, 1.017110, 0.049466, 0.235155, 0.129856, 0.037760, 0.074697),
    deviations=_column(None, 0.2734, 0.1207, 0.4238, None, 0.0294, 0.0133, 0.0255, 0.0692),
    mean_squared_error=9.9884e-4,
    sum_lambda=0.4431,
)

VISCOUS = PublishedModel(
    name="viscous",
    table="7.7",
    deviation_table="7.8",
    values=_values(
        *(2.475884, 0.497314, 0.286792, 1.219998, 0.060944, 0.280288, 0.167525, 0.034953, 0.037130),
        *(3.0e-6, 2.46e-4, 1.7e-5),
    ),
    deviations=_column(None, 0.2930, 0.1380, 0.4547, None, 0.0313, 0.0158, 0.0218, 0.0311, 8.0e-6, 3.95e-4, 3.3e-5),
    mean_squared_error=9.4940e-4,
    sum_lambda=0.5973,
)

VISCOUS_AND_COULOMB = PublishedModel(
    name="viscous + Coulomb",
    table="7.9",
    deviation_table="7.10",
    values=_values(
        *(2.517390, 0.506972, 0.290461, 1.250307, 0.062899, 0.285755, 0.168410, 0.033444, 0.036948),
        *(2.0e-6, 2.53e-4, 2.4e-5, 0.128486),
    ),
    deviations=_column(
        None, 0.2113, 0.0989, 0.3684, None, 0.0253, 0.0127, 0.0193, 0.0296, 4.0e-6, 3.14e-4, 3.8e-5, 0.1129
    ),
    mean_squared_error=7.4877e-4,
    sum_lambda=0.9313,
)

LADDER = (BASIC, BASIC_WITH_BACK_EMF, VISCOUS, VISCOUS_AND_COULOMB)
"""The four fitted models, in the order of chapter 7."""


def _names(text: str) -> frozenset[str]:
    return frozenset(text.split())


INFLUENCE_FAST_WAIST = (
    _names("I1yy m2 c2x c2y c2z I2xx I2xy I2xz I2yy I2yz I2zz m3 c3x c3y c3z I3xx I3xy I3xz I3yy I3yz I3zz"),
    _names("m2 c2x c2y I2xx I2xy I2xz I2yy I2yz I2zz m3 c3x c3y c3z I3xx I3xy I3xz I3yy I3yz I3zz"),
    _names("m3 c3x c3y I3xx I3xy I3xz I3yy I3yz I3zz"),
)
"""Table 5.1: parameters that act on joints 1 to 3 while link 1 moves fast."""

INFLUENCE_SLOW_WAIST = (
    _names("m3 c3x c3y I3zz m2 c2x c2y I2zz I1yy"),
    _names("m3 c3x c3y I3zz m2 c2x c2y I2zz"),
    _names("m3 c3x c3y I3zz"),
)
"""Table 5.2: parameters that act on joints 1 to 3 while link 1 hardly moves."""

RODS_INFLUENCE = (_names("I1yy"), _names("m2 c2x I2yy I2zz"), _names("m3 c3x I3yy I3zz"))
"""Table 5.3: effective inertial parameters of links 1 to 3 when links 2 and 3 are rods."""


PARAMETER = {symbol.name: symbol.parameter for symbol in SYMBOLS}
"""Names of parameters in a model, by the symbols of the source."""
BACK_EMF_SYMBOLS = ("Kb1-3", "Kb2")
FRICTION_SYMBOLS = ("v_eff1", "v_eff2", "v_eff3", "μ̃")


def model_of(published: PublishedModel, machine: Machine, *, published_inertia: bool = True) -> Model:
    """Converts a table of chapter 7 to a model of the machine. Raises SpecError for a machine that is not the MA2000's
    arm."""
    return _with_values(structure_of(published, machine, published_inertia=published_inertia), published.values)


def unfitted(published: PublishedModel, machine: Machine, *, published_inertia: bool = True) -> Model:
    """Returns the same structure at the source's initial values: table 7.2, data-sheet K_b2, no friction."""
    values = {**UNOPTIMISED.values, "Kb2": DATA_SHEET_BACK_EMF_2, **dict.fromkeys(FRICTION_SYMBOLS, 0.0)}
    structure = structure_of(published, machine, published_inertia=published_inertia)
    return _with_values(structure, {s: v for s, v in values.items() if PARAMETER[s] in structure.by_name})


def structure_of(published: PublishedModel, machine: Machine, *, published_inertia: bool = True) -> Model:
    """Returns effects and ties of a table's model, with values of the machine file."""
    model = base_model(machine, friction=False)
    model = model.tied(SHARED_BACK_EMF, ("joint1.motor.back_emf_constant", "joint3.motor.back_emf_constant"))
    if "v_eff1" in published.values:
        model = model.with_effect("viscous_friction", (1, 2, 3))
    if "μ̃" in published.values:
        model = model.with_effect("load_dependent_friction", (1, 2, 3), shared=True)
    return model.model_copy(update={"published_inertia": published_inertia})


def _with_values(model: Model, values: dict[str, float]) -> Model:
    complete = {"Kb2": DATA_SHEET_BACK_EMF_2, **values}
    return model.with_values({PARAMETER[symbol]: value for symbol, value in complete.items()})


class RecomputedFidelity(FrozenRecord):
    """Σλ² of one published model from its values and standard deviations, beside the published sum.

    `contributions` are λ² by symbol; zero where the printed deviation is very large.
    """

    name: str
    table: str
    deviation_table: str
    convention: Convention
    published: float
    ours: float
    contributions: dict[str, float]

    @property
    def relative_difference(self) -> float:
        """(ours − published) / published."""
        return self.ours / self.published - 1.0


def recomputed_fidelities(convention: Convention = "source") -> tuple[RecomputedFidelity, ...]:
    """Returns Σλ² of the four fitted models of chapter 7."""
    return tuple(_recomputed(model, convention) for model in LADDER)


def basis_of_symbol(symbol: str) -> Basis:
    """Returns the rule for the expected deviation of a parameter of chapter 7 (section 7.2.2)."""
    if symbol[0] == "m" or symbol == "MLOAD":
        return "mass"
    return "length" if symbol[0] in "AR" else "gaussian"


def _recomputed(model: PublishedModel, convention: Convention) -> RecomputedFidelity:
    if model.sum_lambda is None or model.deviation_table is None:
        raise ValueError(f"table {model.table} has no sum of contributions")
    contributions = {
        symbol: contribution(model.deviations[symbol], value * deviation_share(basis_of_symbol(symbol), convention))
        for symbol, value in model.values.items()
    }
    return RecomputedFidelity(
        name=model.name,
        table=model.table,
        deviation_table=model.deviation_table,
        convention=convention,
        published=model.sum_lambda,
        ours=math.fsum(contributions.values()),
        contributions=contributions,
    )
