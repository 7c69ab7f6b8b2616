"""The benchmark of following a motion tells a missed target."""

from typing import Any

from benchmarks.feedforward import LEARNED, figures, hidden_effects


def test_arms_that_follow_badly_miss_the_targets_of_following_a_motion() -> None:
    def arm(fitted: float, last: float) -> dict[str, Any]:
        rms = {"plain": 1.0, "fitted": fitted, "diagnosed": 0.05}
        rms |= {f"learned {k}": 0.1 for k in range(1, LEARNED)} | {f"learned {LEARNED}": last}
        run = {label: {"rms": one, "largest": 3 * one, "expected": one} for label, one in rms.items()}
        return {"seed": 1, "hidden": hidden_effects(1), "named": ["x"], "runs": {"sine": run}}

    def missed(*arms: dict[str, Any]) -> int:
        return sum(figure.met is False for figure in figures(arms))

    assert hidden_effects(1) == hidden_effects(1) != hidden_effects(2)
    assert missed(arm(0.06, 0.1)) == 0
    assert missed(arm(0.06, 0.1), arm(0.4, 0.1)) == 1, "a third of the plain error is exceeded"
    assert missed(arm(0.06, 0.1), arm(0.06, 0.2)) == 1, "the last attempt is worse than the one before"
    assert missed(arm(0.04, 0.1)) == 1, "the diagnosis has made it worse"
