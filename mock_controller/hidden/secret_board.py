"""A board whose memory follows a secret map, with other registers between those of the host."""

from __future__ import annotations

from typing import Any

from mock_controller.board.board import Board
from mock_controller.board.snapshot import PeriodSnapshot
from mock_controller.hidden.memory import HiddenMemory


class SecretBoard(Board):
    """A `Board` with a secret memory; other arguments are those of `Board`."""

    def __init__(self, secret: HiddenMemory, *arguments: Any, **options: Any) -> None:
        self._secret = secret
        self._before: PeriodSnapshot | None = None
        high = secret.map["position"].high or ()
        self._changing = [other for other in secret.others if other.changes]
        self._flags = {address: flags << 4 for address, flags in zip(high, secret.flags, strict=True)}
        super().__init__(*arguments, **options)

    def _to_publish(self, results: PeriodSnapshot) -> list[tuple[int, int]]:
        own = [(address, value | self._flags.get(address, 0)) for address, value in super()._to_publish(results)]
        # Constants are stored only once, in the first period after power-up.
        stored = self._changing if results.tick > 1 else self._secret.others
        others = [pair for other in stored for pair in other.pairs(results, self._before)]
        self._before = results
        return own + others
