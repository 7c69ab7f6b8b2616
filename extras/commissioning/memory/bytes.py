"""Properties of single bytes: how far they change, and which of them follow only one joint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from extras.commissioning.memory.recording import Pages, Recording, Stage

WHOLE_TURN = 150
"""Least spread of a low byte while its joint is moved by hand: 300 counts take it through all 256 values."""
AT_REST = 64
"""Largest spread of a joint's bytes while another joint is moved: a quarter of a low byte, 4 degrees of a major
axis."""


def spread(pages: Pages) -> NDArray[np.int64]:
    """Returns the length of the shortest arc modulo 256 that holds all values of each byte; 0 for a constant one."""
    size = pages.shape[1]
    seen = np.zeros((size, 256), bool)
    seen[np.arange(size), pages] = True
    twice = np.concatenate([seen, seen], axis=1)
    places = np.where(twice, np.arange(512), -1)
    last = np.maximum.accumulate(places, axis=1)[:, :-1]
    gaps = np.where(twice[:, 1:] & (last >= 0), np.arange(1, 512) - last, 0)
    result: NDArray[np.int64] = 256 - gaps.max(axis=1)
    return result


def distinct(pages: Pages) -> NDArray[np.int64]:
    """Returns the number of different values of each byte."""
    size = pages.shape[1]
    seen = np.zeros((size, 256), bool)
    seen[np.arange(size), pages] = True
    result: NDArray[np.int64] = seen.sum(axis=1)
    return result


@dataclass(frozen=True)
class Followers:
    """Bytes (offsets) that change while one joint is moved by hand, and rest while others are.

    low:   those that take most of their values: low bytes
    high:  those that change, high bytes among them
    byte:  those that change by more than a little: values of one byte
    """

    low: tuple[int, ...]
    high: tuple[int, ...]
    byte: tuple[int, ...]


def followers(recording: Recording, joint: int) -> Followers:
    """Returns the bytes that follow a joint."""
    led = recording.led(joint)
    if not led:
        return Followers((), (), ())
    pages = np.concatenate([stage.pages for stage in led])
    others = recording.undisturbed(joint)
    at_rest = np.max([spread(stage.pages) for stage in others], axis=0) if others else np.zeros(recording.size, int)
    moved, values = spread(pages), distinct(pages)
    quiet = at_rest <= AT_REST
    return Followers(
        tuple(np.flatnonzero(quiet & (moved >= WHOLE_TURN)).tolist()),
        tuple(np.flatnonzero(quiet & (at_rest <= 2) & (values >= 2)).tolist()),
        tuple(np.flatnonzero(quiet & (moved >= 16) & (values >= 8)).tolist()),
    )


def constants(stages: list[Stage]) -> NDArray[np.int64]:
    """Returns the value of each byte that is constant throughout these stages; -1 for those that are not."""
    pages = np.concatenate([stage.pages for stage in stages])
    first = pages[0].astype(np.int64)
    return np.where((pages == pages[0]).all(axis=0), first, -1)
