"""Writes settings as a TOML file, from which they can be loaded again."""

from __future__ import annotations

import json
from types import NoneType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from daq.config.settings import Settings


def settings_text(settings: Settings) -> str:
    """Returns a daq.toml that loads to these settings. A setting without value becomes a comment, since TOML has no
    null."""
    data = settings.model_dump(mode="json")
    if settings.robots:  # each robot has its own table
        del data["robot"], data["server"]["unattended"]
    else:
        del data["robots"]
    return tables_text(data)


def tables_text(data: dict[str, Any]) -> str:
    """Returns values and tables as TOML; None becomes a comment."""
    lines = _lines("", {key: value for key, value in data.items() if not isinstance(value, dict)})
    for name, table in data.items():
        if isinstance(table, dict):
            lines += ["", *_lines(name, table)]
    return "\n".join(lines).lstrip("\n") + "\n"


def _lines(name: str, table: dict[str, Any]) -> list[str]:
    """The table's own keys, then its subtables."""
    lines = [f"[{name}]"] if name else []
    lines += [f"# {key} is not set" for key, value in table.items() if value is None]
    lines += [f"{key} = {toml_value(value)}" for key, value in table.items() if not isinstance(value, dict | NoneType)]
    for key, value in table.items():
        if isinstance(value, dict):
            lines += ["", *_lines(f"{name}.{key}", value)]
    return lines


def toml_value(value: Any) -> str:
    """Formats a value as TOML: as in JSON, except that TOML requires DEL to be escaped."""
    if isinstance(value, list):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key} = {toml_value(one)}' for key, one in value.items() if one is not None)}}}"
    return json.dumps(value, ensure_ascii=False, allow_nan=False).replace("\x7f", "\\u007f")
