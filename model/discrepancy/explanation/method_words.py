"""Which of the two methods an answer comes from, in words."""

from __future__ import annotations

from collections.abc import Mapping

from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.grounds import Method

WORDS: Mapping[Method, str] = {
    "output-error": "simulation of the closed loop (output error)",
    "inverse-dynamics": "balance of torques along the recorded motion (inverse dynamics)",
}


def method_words(found: Diagnosis) -> str:
    """How model and traces were compared, as a noun."""
    return WORDS[found.method]
