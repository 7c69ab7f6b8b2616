"""The page of all keys of daq.toml, from the classes that read it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args

from pydantic import BaseModel
from pydantic_core import PydanticUndefined
from sphinx.pycode import ModuleAnalyzer

from daq.config.settings import settings_type

from .command_line import plain

BEGIN = """# Configuration keys

Made from the classes that read `daq.toml`. An unknown key is an error. An environment variable overrides
the file: `DAQ_`, the section and the key in capitals, with two underscores between them, such as `DAQ_ROBOT__PORT`.
[User guide](../user-guide.md#the-real-arm) and [Service](../service.md#installing-it) show whole files;
`daq config show` prints what is in force, and where it was looked for.
"""


def page() -> str:
    """The page as it should be. Raises LookupError for a key without a meaning."""
    return "\n".join([BEGIN, *_section(settings_type(), "")])


def _section(part: type[BaseModel], name: str) -> Iterator[str]:
    inner: list[tuple[type[BaseModel], str]] = []
    meanings = _meanings(part)
    yield f"## {f'`[{name}]`' if name else 'At the top'}\n"
    if name:
        yield f"{' '.join((part.__doc__ or '').split())}\n"
    for key, field in part.model_fields.items():
        section = _model(field.annotation)
        if section is not None and not _is_list(field.annotation):
            inner.append((section, f"{name}.{key}".strip(".")))
            continue
        if section is not None:
            inner.append((section, f"{name}.{key}[]"))
        meaning = meanings.get(key)
        if not meaning:
            raise LookupError(f"{part.__module__}.{part.__name__}.{key} has no docstring")
        yield f"`{key}`\n: {plain(meaning)} {_default(field)}\n"
    for section, path in inner:
        yield from _section(section, path)


def _model(kind: Any) -> type[BaseModel] | None:
    """The class of a section, or of the entries of a list of sections."""
    candidates = [kind, *get_args(kind), *(inner for one in get_args(kind) for inner in get_args(one))]
    return next((one for one in candidates if isinstance(one, type) and issubclass(one, BaseModel)), None)


def _is_list(kind: Any) -> bool:
    return any(getattr(one, "__origin__", None) is tuple for one in (kind, *get_args(kind)))


def _default(field: Any) -> str:
    if field.default is PydanticUndefined:
        return "Needed."
    if field.default in (None, ()):
        return "By default none."
    return f"By default `{str(field.default).lower() if isinstance(field.default, bool) else field.default}`."


def _meanings(part: type[BaseModel]) -> dict[str, str]:
    """Text under each field in the source of a class."""
    said = ModuleAnalyzer.for_module(part.__module__).find_attr_docs()
    return {key: " ".join(" ".join(lines).split()) for (owner, key), lines in said.items() if owner == part.__name__}
