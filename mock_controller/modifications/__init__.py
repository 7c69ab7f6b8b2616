"""Hidden physical effects: named modifications of the plant and the board, absent by default.

`registry` finds them by name. A new effect is a class in a file here, declared by `parameter.effect`; it acts through
the extension points of plant and board.
"""

from mock_controller.modification import Modification
from mock_controller.modifications.registry import ModificationError, build_modifications, known_modifications

__all__ = ["Modification", "ModificationError", "build_modifications", "known_modifications"]
