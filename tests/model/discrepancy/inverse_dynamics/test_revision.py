"""Effects that are looked for once more with all others in place, and effects of which each takes too little alone."""

from __future__ import annotations

import pytest

from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.inverse_dynamics.options import TorqueOptions
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs


def adopted(found: Diagnosis) -> set[tuple[str | None, tuple[int, ...]]]:
    return {(s.effect, s.joints) for s in found.steps if s.adopted}


def slide(effects: tuple[str, ...], **hidden: float) -> Diagnosis:
    options = TorqueOptions(effects=effects, least_evidence=10.0)
    training, held_out = (rigs.slide_trace(seed, hidden) for seed in (1, 2))
    return diagnose_torques(base_model(rigs.slide_machine()), [training], [held_out], options)


def test_effects_of_which_each_takes_a_third_are_named_together() -> None:
    hidden = {"coulomb": 6.0, "hum": 8.5, "spring": 120.0}
    alone = slide(("coulomb_friction",), **hidden)
    assert [s.refusal.kind for s in alone.steps if s.refusal] == ["leaves-more-than-noise"], alone.summary
    found = slide(("coulomb_friction", "periodic_disturbance", "spring_torque"), **hidden)
    assert adopted(found) == {(n, (1,)) for n in ("coulomb_friction", "periodic_disturbance", "spring_torque")}


def test_the_gap_shrinks_with_every_step_though_steps_were_looked_for_again() -> None:
    found = slide(("coulomb_friction", "periodic_disturbance"), coulomb=6.0, hum=8.5)
    assert found.gap is not None
    for errors in ([s.fitted[0] for s in found.gap.stages], [s.held_out[0] for s in found.gap.stages]):
        _, fitted, first, second = [error or 0.0 for error in errors]
        assert fitted > 1.2 * first > 1.2 * 1.2 * second > 0.0
    earlier, later = (s for s in found.steps if s.adopted)
    assert later.rmse_fit[0].before == pytest.approx(earlier.rmse_fit[0].after)
