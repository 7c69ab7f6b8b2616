"""The section of a diagnosis's report that says whether MuJoCo, too, comes closer to the records with the effect."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from daq.contracts.errors import DaqError
from daq.contracts.trace import Trace
from extras.formats.robot_files.replay import WINDOW, Replay, replay
from model.blocks import Block, Cell, Section, Table, Text, cells
from model.discrepancy.diagnosis import Diagnosis
from model.effects.names import capitalised, effect_on
from model.reports.numbers import column
from model.units import shown_unit, with_unit

TITLE = "Replayed in MuJoCo"
HOW = (
    "MuJoCo was given the recorded drive and a MJCF of each model, and started again from the recorded motion every "
    f"{WINDOW:g} s. No code of the simulation above takes part."
)


def replay_section(found: Diagnosis, traces: Sequence[Trace]) -> Section | None:
    """The section; None where no effect was added, or where no trace has the drive that a replay needs."""
    added = [step for step in found.steps if step.adopted and step.effect is not None]
    driven = [trace for trace in traces if trace.drive is not None]
    if not added or not driven:
        return None
    held = [trace for trace in driven if trace.record.trace_id in found.holdout]
    kinds = [("fitted to", [trace for trace in driven if trace not in held]), ("held out", held)]
    try:
        made = [(kind, replay(found.model_before, found.model_after, some)) for kind, some in kinds if some]
    except DaqError as error:
        return Section(TITLE, (Text(f"MuJoCo replays nothing: {error}.", "quiet"),))
    judged = made[-1][1]
    names = {step.effect for step in added}
    lost = [effect_on(use.name, use.joints) for use in judged.left_out if use.name in names]
    joints = sorted({joint for step in added for joint in step.joints}) or list(judged.joints)
    blocks: list[Block] = [Text(HOW)]
    if lost:
        blocks.append(Text(f"MuJoCo has no form of {'; '.join(lost)}: it is not in this replay.", "warning"))
    blocks += [Text(words, tone) for words, tone in (_said(judged, joint) for joint in joints)] if not lost else []
    return Section(TITLE, (*blocks, replay_table(made)))


def _said(made: Replay, joint: int) -> tuple[str, Literal["good", "warning"]]:
    """Whether the replay of a joint came closer, and how that is marked."""
    place = made.joints.index(joint)
    before, after = float(made.before[place]), float(made.after[place])
    factor, unit = shown_unit(made.units[place])
    was, is_ = column([factor * before, factor * after])
    words = f"on joint {joint} its error goes from {was} to {with_unit(is_, unit)}"
    if after < before:
        return f"MuJoCo agrees: {words}.", "good"
    return f"MuJoCo does not agree: {words}.", "warning"


def replay_table(made: Sequence[tuple[str, Replay]]) -> Table:
    """A row a joint and kind of traces: root mean square of recorded − replayed, before and after."""
    sizes: dict[str, list[float]] = {}
    for _, one in made:
        for name, *pair in zip(one.units, one.before, one.after, strict=True):
            factor, unit = shown_unit(name)
            sizes.setdefault(unit, []).extend(factor * float(value) for value in pair)
    texts = {unit: iter([with_unit(text, unit) for text in column(values)]) for unit, values in sizes.items()}
    rows = []
    for kind, one in made:
        for joint, name in zip(one.joints, one.units, strict=True):
            _, unit = shown_unit(name)
            rows.append((Cell(kind), *cells(str(joint), next(texts[unit]), next(texts[unit]))))
    caption = "Root mean square of recorded − replayed position."
    lost = [effect_on(use.name, use.joints) for use in made[-1][1].left_out]
    caption += f" {capitalised('; '.join(lost))}: not in MJCF." if lost else ""
    return Table(("traces", "joint", "before", "after"), tuple(rows), caption)
