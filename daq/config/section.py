"""Base class of configuration sections that plug-ins add."""

from __future__ import annotations

from typing import Any, ClassVar

from daq.contracts.frozen import FrozenRecord


class Section(FrozenRecord):
    """A section added by a plug-in: `Plugin.settings` names the class. Every key has a default."""

    SHOWN: ClassVar[frozenset[str]] = frozenset()
    """Keys whose wrong values errors may show. Values of all other keys may be secrets."""

    def digested(self) -> dict[str, Any]:
        """Returns the data for the section's digest in the audit log, which changes with the section."""
        return self.model_dump(mode="json")
