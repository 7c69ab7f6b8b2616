"""Labels of traces that need nothing to be loaded: completion by the shell reads them, too."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

Outcome = Literal["complete", "stopped", "fault", "interrupted"]
"""How a recording ended."""
Source = Literal["mock", "real", "imported"]
"""Where a trace of the catalogue comes from."""
Tag = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.:-]{0,39}$")]
"""A word that somebody gave a trace."""
