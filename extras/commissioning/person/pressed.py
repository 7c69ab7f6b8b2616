"""Reminds the person to keep the emergency stop pressed, however the work ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from extras.commissioning.memory.procedure import Operator

KEEP_PRESSED = "Keep the emergency stop pressed: switch the controller off and on before you release it."


@dataclass
class EmergencyStop:
    """Whether the emergency stop is pressed, as far as the program knows.

    If a `with` block ends while it is, normally or by an exception, the person is told. note: called with every change
    """

    operator: Operator
    note: Callable[[bool], None] = lambda _pressed: None
    pressed: bool = False

    def tell(self, pressed: bool) -> None:
        """Notes that it is about to be pressed, or was released safely."""
        self.pressed = pressed
        self.note(pressed)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, raised: BaseException | None, at: TracebackType | None
    ) -> None:
        if self.pressed:
            self.operator.show(KEEP_PRESSED)
