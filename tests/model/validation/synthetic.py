"""Traces that a model makes of itself, so that the truth behind them is known."""

from dataclasses import replace

import numpy as np

from daq.contracts.trace import Trace
from model.machine_model.model import Model
from tests.model.fitting import imagined

START = (np.pi, np.pi / 4, 0.0)
REST_BEFORE = 40
"""Periods."""


def ramp_trace(plant: Model, seconds: float = 1.6, seed: int = 0, *, held: bool = False) -> Trace:
    """The experiment's ramp (section 6.5) run by `plant`, with the sensors' noise.

    `held`: it begins with the arm held by its drive, as a real one does; else with no drive, and it sinks at first.
    """
    time = imagined.PERIOD * np.arange(round(seconds / imagined.PERIOD))
    rise = np.radians(21.6) * np.clip((time - 0.2) / 0.65, 0, 1)
    return _run(plant, np.array(START) + rise[:, None], seed, held)


def swinging_trace(plant: Model, seconds: float = 6.0, seed: int = 0, *, held: bool = False) -> Trace:
    """Two sines a joint, out of step; `held` as above."""
    time = np.maximum(imagined.PERIOD * np.arange(round(seconds / imagined.PERIOD)) - 0.2, 0)
    waves = [
        np.sin(2 * np.pi * (0.4 + 0.13 * j) * time) + 0.5 * np.sin(2 * np.pi * (1.1 + 0.2 * j) * time) for j in range(3)
    ]
    return _run(plant, np.array(START) + np.radians(20) * np.stack(waves, axis=1), seed, held)


def multisine_trace(plant: Model, seconds: float = 12.0, seed: int = 0, *, held: bool = False) -> Trace:
    """Six tones a joint between 0.1 and 0.8 Hz, of 20°, 14° and 20°; other phases with every seed; `held` as above."""
    time = np.maximum(imagined.PERIOD * np.arange(round(seconds / imagined.PERIOD)) - 0.2, 0)
    phases = np.random.default_rng([seed, 1]).uniform(0, 2 * np.pi, (6, 3))
    tones = np.linspace(0.1, 0.8, 6)
    waves = sum(np.sin(2 * np.pi * f * time[:, None] + p) - np.sin(p) for f, p in zip(tones, phases, strict=True))
    scale = np.radians((20.0, 14.0, 20.0)) / np.abs(waves).max(axis=0)
    return _run(plant, np.array(START) + scale * waves, seed, held)


def _run(plant: Model, set_points: np.ndarray, seed: int, held: bool) -> Trace:
    before = REST_BEFORE if held else 0
    whole = imagined.trace(
        plant, seed=seed, points=np.concatenate([np.repeat(set_points[:1], before, axis=0), set_points])
    )
    signals = ("time", "tick", "set_point", "position", "drive")
    return replace(whole, error=None, **{name: getattr(whole, name)[before:] for name in signals})
