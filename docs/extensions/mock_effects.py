"""The page of the mock's hidden effects, from the classes that make them and the sizes that secrets draw."""

from __future__ import annotations

from collections.abc import Iterator

from mock_controller.hidden.sizes import LATER_SIZES, OPEN_SIZES, SHARED_SIZES, SizeRange
from mock_controller.modifications.parameter import fields_of
from mock_controller.modifications.registry import is_shared, known_modifications

from .command_line import plain

BEGIN = """# Hidden effects of the mock

Made from the mock's own library. [Mock](../mock.md#hidden-effects) explains how effects are added and drawn.
Sizes are those that a secret draws, for joints 1 / 2 / 3 where they differ, or for the joints named.
"""
HEAD = """| effect | physics | parameters (allowed; **absent at**) | sizes a secret draws | source |
|---|---|---|---|---|"""
SHARED = "## Effects whose names the diagnosis knows\n"
OPEN = "## Effects that only the mock knows\n\nFor the diagnosis each is an unknown effect.\n"


def page() -> str:
    """The page as it should be."""
    sizes = {size.effect: size for size in (*SHARED_SIZES, *LATER_SIZES, *OPEN_SIZES)}
    rows: dict[bool, list[str]] = {True: [], False: []}
    for name, kind in known_modifications().items():
        cells = (
            f"`{name}`",
            plain(kind.line),
            "; ".join(_parameters(kind)),
            _sizes(sizes.get(name)),
            plain(kind.source),
        )
        rows[is_shared(name)].append(f"| {' | '.join(cells)} |")
    return "\n".join([BEGIN, SHARED, HEAD, *rows[True], "", OPEN, HEAD, *rows[False], ""])


def _parameters(kind: type) -> Iterator[str]:
    for key, field in fields_of(kind).items():
        facts = field.metadata
        unit = "" if facts["unit"] == "1" else f" {facts['unit']}"
        absent = "" if facts["null"] is None else f", **{facts['null']:g}**"
        yield f"`{key}` {facts['low']:g} to {facts['high']:g}{unit}{absent}"


def _sizes(size: SizeRange | None) -> str:
    """Such as `0.3–5 / 0.7–9 / 0.15–1.8`."""
    if size is None:
        return ""
    drawn = [size.ranges[joint - 1] for joint in (size.joints if size.acts_on_joints else (1,))]
    text = " / ".join(dict.fromkeys(f"{low:g}–{high:g}" for low, high in drawn))
    joints = f" (joints {', '.join(map(str, size.joints))})" if len(size.joints) < 3 else ""
    return f"{'± ' if size.signed else ''}{text}{joints}"
