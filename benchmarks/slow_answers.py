"""Where the time of the slowest answers went, as a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from statistics import fmean

from benchmarks.figures import quantile
from benchmarks.service_clients import Answer

STAGES: dict[str, Callable[[Answer], float]] = {
    "client: until it was sent": lambda one: one.sent - one.due,
    "until the service read it": lambda one: one.heard - one.sent,
    "until the application began": lambda one: one.begun - one.heard,
    "until the answer's head": lambda one: one.answered - one.begun,
    "client: until all was received": lambda one: one.received - one.answered,
}
"""Parts of an answer's time, one after the other."""
SPENT: dict[str, Callable[[Answer], float]] = {
    "of the service's: loop waits for a core": lambda one: one.waited,
    "of the service's: loop computes": lambda one: one.own,
    "of the service's: other threads compute": lambda one: one.every - one.own,
}


def _latency(answer: Answer) -> float:
    return answer.received - answer.due


def where_it_went(answers: Sequence[Answer]) -> str:
    """A table of means in ms: the slowest hundredth of answers, beside all; and which addresses are among them."""
    slow = sorted(answers, key=_latency)[-max(1, len(answers) // 100) :]
    lines = [f"\nmeans in ms: of the slowest {len(slow)}, of all {len(answers)}; p99 of each"]
    for name, part in ({"whole": _latency} | STAGES | SPENT).items():
        columns = (fmean(map(part, slow)), fmean(map(part, answers)), quantile(list(map(part, answers)), 0.99))
        lines.append(f"  {name:42}" + "".join(f"{1e3 * value:9.2f}" for value in columns))
    for path in sorted({one.path for one in answers}):
        of_path = [one for one in answers if one.path == path]
        count = sum(one.path == path for one in slow)
        p99 = 1e3 * quantile(list(map(_latency, of_path)), 0.99)
        lines.append(f"  {count:4} of the slowest are {path}, p99 {p99:.1f} ms")
    lines += ["  the ten slowest, when they were due and the parts in ms:"]
    for one in slow[-10:]:
        parts = " ".join(f"{1e3 * part(one):7.2f}" for part in (STAGES | SPENT).values())
        lines.append(f"    {one.due - answers[0].due:8.3f} s {parts}  {one.path}")
    return "\n".join(lines)
