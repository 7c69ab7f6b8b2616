"""While the emergency stop is pressed: whatever ends the work says that it has to stay pressed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from extras.commissioning.memory.procedure import Operator

KEEP_PRESSED = "Keep the emergency stop pressed: switch the controller off and on before you release it."


@dataclass
class EmergencyStop:
    """Whether the emergency stop is pressed, as far as the program knows. A block that is left while it is, by its end
    or by anything raised, tells the person.

    note: told of every change
    """

    operator: Operator
    note: Callable[[bool], None] = lambda _pressed: None
    pressed: bool = False

    def tell(self, pressed: bool) -> None:
        """That it is about to be pressed, or was released safely."""
        self.pressed = pressed
        self.note(pressed)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, raised: BaseException | None, at: TracebackType | None
    ) -> None:
        if self.pressed:
            self.operator.show(KEEP_PRESSED)
