"""Writes the folder of a rig."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from trials.rigs.lab import beside_text, machine_text, records_text
from trials.rigs.recorded_rig import make_rig
from trials.rigs.rig import Rig
from trials.rigs.sharpness import sharpness


def write_rig(
    folder: Path, kind: str, seed: int, case: str | None = None, effect: str | None = None, *, sharp: bool = False
) -> list[Path]:
    """Writes one rig's folder; returns the paths. The truth is beside `lab`, never in it."""
    made = make_rig(kind, seed, case, effect)
    lab = folder / "lab"
    lab.mkdir(parents=True, exist_ok=True)
    texts = {lab / "machine.toml": machine_text(made.rig)}
    for name, motion in made.records.items():
        texts[lab / f"{name}.csv"] = records_text(made.rig, motion, name)
        texts[lab / f"{name}.toml"] = beside_text(made.rig)
    truth = truth_of(made.rig, made.case)
    if sharp and made.case in ("single", "sound"):
        truth["sharpness"] = [asdict(rival) for rival in sharpness(made.rig)]
    texts[folder / "truth.json"] = json.dumps(truth, indent=1, ensure_ascii=False) + "\n"
    for path, text in texts.items():
        path.write_text(text, "utf-8")
    return list(texts)


def truth_of(rig: Rig, case: str) -> dict[str, Any]:
    """Returns the hidden truth: the effects, and every parameter of the rig."""
    names = rig.joints.dtype.names or ()
    return {
        "kind": rig.kind_name,
        "seed": rig.seed,
        "case": case,
        "hidden": [asdict(hidden) for hidden in rig.hidden],
        "bodies": asdict(rig.bodies),
        "joints": [{name: float(p[name]) for name in names} for p in rig.joints],
        "loop": {name: float(rig.loop[name][0]) for name in rig.loop.dtype.names or ()},
        "stated_wrongly": [asdict(tolerance) for tolerance in rig.tolerances],
    }
