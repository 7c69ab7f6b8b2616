"""What a fit has shown stands before what a probe promises, however much that is."""

from model.discrepancy.diagnosis import Candidate, in_order


def candidate(effect: str, evidence: float, *, refitted: bool) -> Candidate:
    return Candidate(effect=effect, joints=(1,), evidence=evidence, refitted=refitted)


def test_fitted_candidates_come_first_each_kind_by_evidence() -> None:
    tried = (
        candidate("stiction", 10070.0, refitted=False),
        candidate("supply_limit", 182.0, refitted=True),
        candidate("backlash", 20000.0, refitted=False),
        candidate("coulomb_friction", 2064.0, refitted=True),
    )
    fitted, probed = in_order(tried)
    assert [c.effect for c in fitted] == ["coulomb_friction", "supply_limit"]
    assert [c.effect for c in probed] == ["backlash", "stiction"]
