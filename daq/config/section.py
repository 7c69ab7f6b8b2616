"""What a section of the configuration has that a plug-in adds."""

from __future__ import annotations

from typing import Any, ClassVar

from daq.contracts.frozen import FrozenRecord


class Section(FrozenRecord):
    """A section that a plug-in adds: `Plugin.settings` names the class. Every key has a default."""

    SHOWN: ClassVar[frozenset[str]] = frozenset()
    """Keys whose wrong values an error shows. Those of any other key may be secrets."""

    def digested(self) -> dict[str, Any]:
        """Returns what the audit log computes a digest of: it changes with the section."""
        return self.model_dump(mode="json")
