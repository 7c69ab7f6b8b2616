"""The whole workflow on arms of which no effect of the library is true: from the mock's wire, without a name."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.model.discrepancy.diagnosed import diagnosed


@pytest.mark.timeout(400)
def test_an_effect_that_no_law_of_the_library_describes_is_not_given_a_name(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, "drive_coupling:joint=1,onto=2,share=0.2")
    assert answer.verdict == "unknown-effect", answer.summary
    assert not [s for s in answer.steps if s.adopted]
    assert answer.summary.startswith("joint 2")


@pytest.mark.timeout(400)
def test_a_sound_arm_is_called_sound(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path)
    assert answer.verdict == "nothing-significant", answer.summary
    assert not [s for s in answer.steps if s.adopted]
    assert answer.where is not None
    assert answer.where.joint is None
    assert answer.where.cells
    assert answer.candidates, "what was tried proves that nothing is significant"
    assert answer.significant is not None
    assert max((c.evidence for c in answer.candidates if c.refitted), default=0.0) < answer.significant
