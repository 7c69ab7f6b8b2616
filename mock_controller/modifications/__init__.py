"""Hidden physical effects: named modifications of the plant and the board, absent by default.

`interface` says where one may act, `registry` knows them by name. A new effect is a file here, listed in `library`.
"""

from mock_controller.modifications.interface import Modification
from mock_controller.modifications.registry import ModificationError, build_modifications, known_modifications

__all__ = ["Modification", "ModificationError", "build_modifications", "known_modifications"]
