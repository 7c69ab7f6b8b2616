"""Whether an expression of PromQL names only metrics, labels and values that a service has."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, get_args

import promql_parser
from prometheus_client.parser import text_string_to_metric_families

from daq.contracts.service.experiments import ENDS
from daq.contracts.service.jobs import JobState
from daq.link.counters import COUNTED
from extras.lab.prometheus.part import ROUND_TRIPS
from server.api.documented import PROBLEM_EXAMPLES

OF_PROMETHEUS = frozenset({"instance", "job"})
"""Labels that Prometheus adds to what it reads, and to `up`, which it makes itself."""
VALUES: Mapping[str, frozenset[str]] = {
    "state": frozenset({*ENDS, *get_args(JobState)}),
    "counter": COUNTED | {"damaged"},
    "figure": frozenset(ROUND_TRIPS.values()),
    "reason": frozenset(met.problem.kind for met in PROBLEM_EXAMPLES),
    "status": frozenset({"200", "500"}),
}
"""Values of labels that a service has once something has happened."""


@dataclass(frozen=True)
class Scraped:
    """The labels of every name of a sample, and the values of each."""

    labels: Mapping[str, Mapping[str, set[str]]]

    @classmethod
    def of(cls, text: str) -> "Scraped":
        """What a service has answered at /metrics."""
        found: dict[str, dict[str, set[str]]] = {"up": {}}
        for family in text_string_to_metric_families(text):
            for sample in family.samples:
                labels = found.setdefault(sample.name, {})
                for label, value in sample.labels.items():
                    labels.setdefault(label, set()).add(value)
        return cls(found)


def wrong(expression: str, scraped: Scraped) -> list[str]:
    """One line for whatever an expression names that is not there. Raises ValueError for one that cannot be parsed."""
    parsed = promql_parser.parse(re.sub(r"\$(service|robot)", ".*", expression))
    lines: list[str] = []
    labels = set(OF_PROMETHEUS)
    for selector in _nodes(parsed, promql_parser.VectorSelector):
        known = scraped.labels.get(selector.name)
        if known is None:
            lines.append(f"no metric {selector.name}")
            continue
        labels |= set(known)
        for matcher in selector.matchers.matchers:
            if matcher.name in OF_PROMETHEUS:
                continue
            if matcher.name not in known:
                lines.append(f"{selector.name} has no label {matcher.name}")
            elif not _matches(matcher, known[matcher.name] | VALUES.get(matcher.name, frozenset())):
                lines.append(f"{selector.name}: {matcher.name} is never {matcher.value}")
    return lines + [f"no label {name}" for name in sorted(_grouped(parsed) - labels)]


def _matches(matcher: Any, values: set[str] | frozenset[str]) -> bool:
    """Whether some value is matched; of alternatives, whether each of them is one."""
    if re.fullmatch(r"[\w|-]+", matcher.value):
        return set(matcher.value.split("|")) <= values
    return any(re.fullmatch(matcher.value, value) for value in values)


def _nodes(parsed: Any, kind: type) -> Iterator[Any]:
    found: list[Any] = []
    promql_parser.walk(parsed, lambda node: found.append(node) if isinstance(node, kind) else None)
    return iter(found)


def _grouped(parsed: Any) -> set[str]:
    """The labels in by, without, on, ignoring and group_left; `le` is that of a histogram's buckets."""
    names: set[str] = set()
    for node in _nodes(parsed, promql_parser.AggregateExpr):
        names |= set(node.modifier.labels if node.modifier else ())
    for node in _nodes(parsed, promql_parser.BinaryExpr):
        if node.modifier is not None:
            matching = node.modifier.matching
            names |= {*(matching.labels if matching else ()), *(node.modifier.group_labels or ())}
    return names
