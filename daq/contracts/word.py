"""The operator's consent that a real arm may move: True, and no other value that is merely truthy."""

from __future__ import annotations

from daq.contracts.errors import SpecError


def require_word(moves_real_arm: object) -> bool:
    """The consent, False where it is not given. Raises SpecError for any value other than True and False."""
    if not isinstance(moves_real_arm, bool):
        raise SpecError(f"moves_real_arm = {moves_real_arm!r:.40}: True is the operator's consent, and False is none")
    return moves_real_arm
