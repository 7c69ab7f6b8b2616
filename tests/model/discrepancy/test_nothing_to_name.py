"""The whole workflow on arms of which no effect of the library is true: from the mock's wire, without a name."""

from pathlib import Path

import pytest

from model.discrepancy.options import DiagnosisOptions
from tests.model.discrepancy.diagnosed import diagnosed

COUPLED = "drive_coupling:joint=1,onto=2,share=0.2"
"""A part of joint 1's drive reaches joint 2: no law of the library describes it."""
IMITATORS = DiagnosisOptions(effects=("coulomb_friction", "motor_inductance", "dead_zone"), joints=(2,))
"""Laws that take most of it, on the joint that it reaches."""


SLOW_REVERSALS, WHOLE = "diagnostic-b", "diagnostic"
"""A quarter of the 55 s set, for every day, and the whole of it, for the slow tests."""


@pytest.mark.parametrize(
    ("experiment", "options"),
    [
        pytest.param(SLOW_REVERSALS, IMITATORS, id="its imitators"),
        pytest.param(WHOLE, None, id="library", marks=pytest.mark.slow),
    ],
)
@pytest.mark.timeout(400)
def test_an_effect_that_no_law_of_the_library_describes_is_not_given_a_name(
    tmp_path: Path, experiment: str, options: DiagnosisOptions | None
) -> None:
    answer = diagnosed(tmp_path, COUPLED, experiment=experiment, options=options)
    assert answer.verdict == "unknown-effect", answer.summary
    assert not [s for s in answer.steps if s.adopted]
    assert answer.summary.startswith("Joint 2")


@pytest.mark.slow
@pytest.mark.parametrize("experiment", [SLOW_REVERSALS, WHOLE])
@pytest.mark.timeout(400)
def test_a_sound_arm_is_called_sound(tmp_path: Path, experiment: str) -> None:
    """The whole library; of two effects, tests/server/jobs/test_job_results.py asks the same every day."""
    answer = diagnosed(tmp_path, experiment=experiment)
    assert answer.verdict == "nothing-significant", answer.summary
    assert not [s for s in answer.steps if s.adopted]
    assert answer.where.joint is None
    assert answer.where.cells
    assert answer.candidates, "what was tried proves that nothing is significant"
    assert max((c.evidence for c in answer.candidates if c.refitted), default=0.0) < answer.significant
