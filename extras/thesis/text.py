"""Formats the reproduction as plain text, our values beside the published ones."""

from __future__ import annotations

from collections.abc import Iterator

from extras.thesis.ladder import Ladder
from extras.thesis.reproduction import Reproduction
from extras.thesis.tables import SYMBOLS


def as_text(result: Reproduction) -> str:
    """Lines for a terminal or a file, without colour."""
    ladders = [line for ladder in result.ladders for line in _ladder(ladder)]
    return "\n".join([*_fidelity(result), *ladders, *_checks(result), *_choices(result), *_findings(result)])


def _fidelity(result: Reproduction) -> Iterator[str]:
    yield "Σλ² recomputed from the published tables"
    yield f"  {'model':20}{'published':>11}{'τ′ = â/(3√2)':>15}{'τ′ = â/3':>12}"
    both = [[f for f in result.fidelity if f.convention == c] for c in ("source", "three_sigma")]
    for source, three in zip(*both, strict=True):
        yield f"  {source.name:20}{source.published:11.4f}{source.ours:15.4f}{three.ours:12.4f}"
    yield ""


def _ladder(ladder: Ladder) -> Iterator[str]:
    yield f"The four models fitted by {ladder.method} to {', '.join(ladder.traces)} (ours | published)"
    yield f"  unoptimised (table 7.2): {ladder.unoptimised_error:.4g} | 2.1428e-3 rad²"
    yield "  " + " " * 18 + "".join(f"{s.name:^26}" for s in ladder.steps)
    yield _row("MSQE rad²", [(s.error, s.published_error) for s in ladder.steps])
    yield _row("Σλ²", [(s.fidelity.sum_of_contributions, s.published_sum) for s in ladder.steps])
    for symbol in SYMBOLS:
        pairs = [
            (s.values[symbol.name], s.published_values[symbol.name]) if symbol.name in s.values else None
            for s in ladder.steps
        ]
        yield _row(f"{symbol.name} {symbol.unit}", pairs)
    yield ""


def _row(name: str, pairs: list[tuple[float, float] | None]) -> str:
    cells = ["" if pair is None else f"{pair[0]:10.4g} | {pair[1]:<10.4g}" for pair in pairs]
    return f"  {name:18}" + "".join(f"{cell:^26}" for cell in cells)


def _checks(result: Reproduction) -> Iterator[str]:
    yield f"What the source says: {len(result.checks) - len(result.failed)} of {len(result.checks)} borne out"
    for check in result.checks:
        yield f"  {'yes' if check.holds else 'NO ':3} {check.name}"
        yield f"        ours: {check.ours}"
        yield f"        published: {check.published}"
    yield ""


def _choices(result: Reproduction) -> Iterator[str]:
    yield "Not given by the source, and chosen"
    for choice in result.choices:
        yield f"  {choice.what}: {choice.value} ({choice.why})"
    yield ""


def _findings(result: Reproduction) -> Iterator[str]:
    yield "Found on the way"
    for finding in result.findings:
        yield f"  - {finding}"
