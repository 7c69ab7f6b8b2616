"""Which of the two methods an answer comes from, in words."""

from __future__ import annotations

from collections.abc import Mapping

from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.grounds import Method

WORDS: Mapping[Method, str] = {
    "output-error": "simulation of the closed loop (output error)",
    "inverse-dynamics": "balance of torques along the recorded motion (inverse dynamics)",
}
EXCHANGED = frozenset({"traces-exchanged", "traces-contradict"})
"""Kinds of notes of answers that are fitted to the traces which were to be held out."""


def method_words(found: Diagnosis) -> str:
    """How model and traces were compared, as a noun; and whether fitted and held-out traces were exchanged."""
    words = WORDS[found.method]
    if any(note.kind in EXCHANGED for note in found.notes_data):
        return f"{words}, in the traces that were held out; the others were held out in turn"
    return words
