"""Work on several things at once: simulations hold no lock of Python's, so two fits take little longer than one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

AT_ONCE = 2
"""The same on every machine: what is begun at once decides what is begun at all."""


def side_by_side(work: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """What `work` makes of every item, in their order. Raises what the first item that fails raises."""
    with ThreadPoolExecutor(AT_ONCE) as threads:
        return list(threads.map(work, items))
