"""What is left where nothing is named, and what differs from the machine file, in words."""

from __future__ import annotations

from model.discrepancy.diagnosis import Diagnosis, SignalError
from model.discrepancy.numbers import plain
from model.effects.names import effect_on
from model.units import with_unit

NOISE_UNKNOWN = 1e6
"""Ratio of a residual to its noise, above which that noise is none: the machine file takes positions for exact, as one
made of a URDF does, and what rounding leaves is no measure."""
WITHIN_NOISE = 3.0
"""Error of a joint, in deviations of its readings' noise, up to which a model is said to explain it within that: sound
rigs of other worlds leave up to 2.6, where friction turns."""


def doubts_of(found: Diagnosis) -> list[str]:
    """What speaks against an answer that names nothing, as clauses: what is left above noise, and the number that is
    farthest from the machine file."""
    said = (_more_than_there_words(found), _left_words(found), _moved_number_words(found))
    return [words for words in said if words is not None]


def _more_than_there_words(found: Diagnosis) -> str | None:
    """That as much torque is left as was recorded, as a clause: then nothing is explained. The noise says nothing here,
    since false readings raise it as well."""
    left = [float(note.values["after"]) for note in found.notes_data if note.kind == "torque-left"]
    return f"{plain(100.0 * left[0], 3)} % of the recorded torque is left" if left and left[0] >= 1.0 else None


def _left_words(found: Diagnosis) -> str | None:
    """The joint that is left farthest above its noise, as a clause; None where all are within it."""
    known = [e for e in (*found.rmse_fit, *found.rmse_holdout) if 0.0 < e.after < NOISE_UNKNOWN * e.floor]
    most = max(known, key=_noises, default=None)
    if most is None or _noises(most) <= WITHIN_NOISE:
        return None
    return f"joint {most.joint} is left with {plain(_noises(most), 2)} times its noise"


def _moved_number_words(found: Diagnosis) -> str | None:
    """The number of the machine file whose estimate is farthest from what it states, as a clause; None where all are
    near."""
    for note in found.notes_data:
        if note.kind == "stated-numbers-moved" and note.warning:
            farthest = note.values["numbers"][0]
            number = found.model_before.by_name.get(farthest["name"])
            effect = None if number is None else number.effect
            name = farthest["name"] if number is None or effect is None else effect_on(effect, number.joints)
            value = with_unit(plain(farthest["value"], 3), farthest["unit"])
            return f"{name} comes out at {value}, where {plain(farthest['expected'], 3)} is stated"
    return None


def _noises(error: SignalError) -> float:
    return error.after / error.floor
