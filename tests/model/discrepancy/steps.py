"""Steps of a diagnosis without signals behind them."""

from __future__ import annotations

from typing import Any

from model.discrepancy.diagnosis import UNWRITTEN, Step, Where

NOWHERE = Where(joint=None, phase=None, summary=UNWRITTEN, cells=(), dependences=())


def step(effect: str | None, joints: tuple[int, ...] = (1,), **fields: Any) -> Step:
    """A step that was taken into the model, before its sentences are made."""
    plain: dict[str, Any] = {
        "parameters": {},
        "evidence": 50.0,
        "margin": 50.0,
        "candidates": (),
        "rmse_fit": (),
        "where": NOWHERE,
        "reason": UNWRITTEN,
        "adopted": True,
    }
    return Step(effect=effect, joints=joints, **(plain | fields))
