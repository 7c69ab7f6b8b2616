"""Steps, shapes and answers of a diagnosis without signals behind them."""

from typing import Any

from model.discrepancy.diagnosis import UNWRITTEN, AgainstWhat, Diagnosis, RemainingShape, Step, Verdict, Where
from model.machine_model.model import Model

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


def shape(
    joint: int = 1,
    against: AgainstWhat = "speed",
    explained: float = 0.5,
    torque: tuple[float | None, ...] = (0.1,) * 5,
) -> RemainingShape:
    """A torque that is left at a joint, by bins of what it goes with."""
    return RemainingShape(
        joint=joint,
        against=against,
        unit="1",
        torque_unit="N·m",
        centres=tuple(map(float, range(len(torque)))),
        torque=torque,
        deviation=torque,
        explained=explained,
    )


def answer_of(model: Model, *steps: Step, verdict: Verdict | None = None, **fields: Any) -> Diagnosis:
    """An answer that has adopted these steps, the model unchanged; by default with the verdict that they give."""
    said: Verdict = "ambiguous" if any(s.group for s in steps) else "named" if steps else "nothing-significant"
    plain = {"model_before": model, "model_after": model, "traces": ("a",), "seconds": 0.0, "robot_seconds": 0.0}
    return Diagnosis(verdict=verdict or said, steps=steps, **{"summary": "", **plain, **fields})
