"""Labels of traces. Imports almost nothing, since shell completion reads them too."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

Outcome = Literal["complete", "stopped", "fault", "interrupted"]
"""How a recording ended."""
Source = Literal["mock", "real", "imported"]
"""Origin of a trace of the catalogue."""
Tag = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.:-]{0,39}$")]
"""A tag that a user gave a trace."""
