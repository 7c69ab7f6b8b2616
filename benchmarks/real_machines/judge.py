"""Compares the answer of `daq diagnose --json` with the known truth: its name for a question, and a mark."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from benchmarks.real_machines.rigs import Number, Question

Answer = Mapping[str, Any]

SAID = {"nothing-significant": "nothing", "unknown-effect": "unknown", "suspected": "suspected"}
"""Words for answers that name nothing. Any other verdict without a name is shown unchanged."""
HONEST = ("unknown", "suspected", "partly", "check-the-record")
"""Answers that name nothing and state that something is missing, or wrong with the record."""
WITHDRAWN = ("found-one-way", "leaves-more-than-noise", "contradicts-file", "worse-than-given")
"""Verdicts that withdraw the result of the search."""


def adopted(answer: Answer) -> list[Mapping[str, Any]]:
    """Returns the steps that are part of the answer."""
    return [step for step in answer["steps"] if step["adopted"]]


def told(step: Mapping[str, Any]) -> set[str]:
    """Returns every effect that a step names, including those of its group."""
    return {step["effect"], *(member["effect"] for member in step["group"])}


def wrong_names(answer: Answer, right: Iterable[str]) -> list[str]:
    """Returns steps without a right or plausible name."""
    allowed = set(right)
    return [_text(step) for step in adopted(answer) if not told(step) & allowed]


def judge(question: Question, answer: Answer, right: Iterable[str]) -> tuple[str, str]:
    """Returns the answer to a question, and a mark: right, half, honest or wrong.

    Half: the right name within a group of others, not on every joint or on a further one, or with another size. A
    warning that a parameter of the file is far off, in place of an effect, also counts as half (`moved`).
    Honest: nothing wrong is named, and the answer states that something is missing. right: names that are not wrong.
    """
    names, joints = set(question.names), set(question.joints)
    hits = [step for step in adopted(answer) if told(step) & names and (not joints or joints & set(step["joints"]))]
    verdict = SAID.get(answer["verdict"], answer["verdict"])
    if hits:
        covered = {joint for step in hits for joint in step["joints"]}
        alone = all(told(step) <= names for step in hits)
        whole = not joints or covered == joints
        size = question.number is None or _within(question.number, joints, answer)
        text = "; ".join(_text(step) for step in hits) + _sizes(question, joints, answer)
        return text, "right" if alone and whole and size else "half"
    withdrawn = [step for step in answer["steps"] if not step["adopted"] and told(step) & names]
    why = next((s["refusal"]["kind"] for s in withdrawn if s.get("refusal")), None)
    others = "; ".join(_text(step) for step in adopted(answer))
    text = verdict if verdict in (*SAID.values(), *HONEST) else f"not named, only {others}"
    if why in WITHDRAWN:
        text += f" ({', '.join(sorted(told(withdrawn[0]) & names))} withdrawn: {why})"
    honest = verdict in HONEST and not wrong_names(answer, right)
    return text, "honest" if honest else "wrong"


def moved(question: Question, note: Mapping[str, Any]) -> str:
    """Returns the parameter of the file that a warning calls far off, if it is the right one with the known value."""
    number = question.moved
    for each in note.get("numbers", ()):
        if number is not None and each["name"] in number.of and number.low <= each["value"] <= number.high:
            return f"{each['name']} {each['value']:.3g} {number.unit}"
    return ""


def _within(number: Number, joints: set[int], answer: Answer) -> bool:
    """Whether every joint has a value in the interval; it may have others, such as a second ripple."""
    found = _found(number, answer)
    return all(
        any(number.low <= value <= number.high and (joint in of or not joints) for of, value in found)
        for joint in joints or {0}
    )


def _found(number: Number, answer: Answer) -> list[tuple[tuple[int, ...], float]]:
    """Returns joints and value of every such parameter of the answer."""
    return [
        (tuple(parameter["joints"]), float(parameter["value"]))
        for step in adopted(answer)
        for name, parameter in step["parameters"].items()
        if any(name.endswith(of) for of in number.of)
    ]


def _sizes(question: Question, joints: set[int], answer: Answer) -> str:
    if question.number is None:
        return ""
    found = [f"{value:.3g}" for of, value in _found(question.number, answer) if not joints or joints & set(of)]
    return f", {', '.join(found)} {question.number.unit}" if found else ""


def _text(step: Mapping[str, Any]) -> str:
    joints = f" on {','.join(map(str, step['joints']))}" if step["joints"] else ""
    return " or ".join(sorted(told(step))) + joints
