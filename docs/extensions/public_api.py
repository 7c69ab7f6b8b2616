"""The page of the public Python interface, and the check that it is whole."""

from __future__ import annotations

import inspect
import re
import types
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from docutils import nodes
from pydantic import BaseModel
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.ext.napoleon.docstring import GoogleDocstring
from sphinx.util import logging

import ma2000

GUIDE = Path(__file__).parents[1] / "python.md"
BEGIN = """# The public Python interface

Made from the docstrings. [From Python](../python.md) shows programs that use it, and says what public means.
"""
HOME: dict[str, str] = ma2000._homes()
PAGE = "reference/python-api"
ARRAY = re.compile(r"~?numpy\.ndarray\[tuple\[.*?\], ~?numpy\.dtype\[[\w.~]+\]\]")
log = logging.getLogger(__name__)


def page() -> str:
    """Every public name below the line of docs/python.md that says what it is."""
    rows = re.findall(
        r"^\| (`.+`) \| (.+) \|$", GUIDE.read_text("utf-8").partition("## The public names")[2], re.MULTILINE
    )
    parts = [BEGIN]
    for names, meaning in rows:
        title = re.sub(r"\s*\(?\[([^\]]*)\]\([^)]*\)\)?", "", meaning).strip()
        parts.append(f"## {title[0].upper()}{title[1:]}\n")
        parts += [_entry(name) for name in re.findall(r"`(\w+)`", names)]
    return "\n".join(parts)


def _entry(name: str) -> str:
    if name == "__version__":
        lines = [".. py:data:: ma2000.__version__", "   :type: str", "", "   The version of the package."]
    elif name == "PRESETS":
        lines = [".. py:data:: ma2000.PRESETS", "   :type: dict[str, ExperimentSpec]", ""]
        lines += ["   The experiments that have a name, by it: `run` and `Client` take the name alone."]
    elif inspect.isclass(found := getattr(ma2000, name)):
        lines = [f".. autoclass:: ma2000.{name}", "   :members:", "   :undoc-members:"]
        hidden = [one for one in ("model_config", "shown", *_of_pydantic(found)) if one in vars(found)]
        lines += [f"   :exclude-members: {', '.join(hidden)}"] if hidden else []
    else:
        lines = [f".. autofunction:: ma2000.{name}"]
    return "\n".join(["```{eval-rst}", *lines, "```", ""])


def _of_pydantic(kind: type) -> list[str]:
    return [one for one in dir(BaseModel) if not one.startswith("__")] if issubclass(kind, BaseModel) else []


def undocumented(name: str) -> list[str]:
    """What of a public name has no docstring: itself, its methods and its properties."""
    found = getattr(ma2000, name)
    if name in ("PRESETS", "__version__"):
        return []
    missing = [] if (found.__doc__ or "").strip() else [name]
    for key, member in list(vars(found).items()) if inspect.isclass(found) else ():
        function = getattr(member, "fget", None) or getattr(member, "__func__", member)
        if key.startswith("_") or not inspect.isroutine(function):
            continue
        if not (function.__doc__ or "").strip():
            missing.append(f"{name}.{key}")
    return missing


def _check(app: Sphinx, env: BuildEnvironment) -> None:
    """Warns of public names that the reference lacks, or that say nothing of themselves."""
    del app
    known = env.domains.python_domain.objects
    for name in ma2000.__all__:
        if f"ma2000.{name}" not in known:
            log.warning("ma2000.%s is public and not in the reference", name)
        for missing in undocumented(name):
            log.warning("ma2000.%s is public and has no docstring", missing)


def _signature(
    app: Sphinx, what: str, name: str, found: Any, options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None] | None:
    """A record of many fields lists them below, and not in its signature a second time. What Python would not read
    again, or nobody, is said by its name: functions as defaults, arrays with their type of number."""
    del app, name, options
    if what == "class" and issubclass(found, BaseModel):
        return "", None
    if signature is None:
        return None
    return _readable(signature), None if returned is None or what == "class" else _readable(returned)


def _readable(signature: str) -> str:
    return ARRAY.sub("~numpy.ndarray", re.sub(r"<function (\w+)(?: at 0x\w+)?>", r"\1", signature))


def _docstring(app: Sphinx, what: Any, name: str, found: Any, options: Any, lines: list[str]) -> None:
    """Sections such as `Raises:`, and lines that each tell of one field, become lists. The docstring of a field has
    neither: its first colon is prose."""
    lines[:] = [re.sub(r"\[([^\]]+)\]\([^)]+\)", r"\1", line) for line in lines]  # links, as pages have them
    if what in ("class", "exception", "function", "method"):
        fields = get_fields(found) if inspect.isclass(found) else set()
        lines[:] = GoogleDocstring(as_list(lines, fields), app.config, app, what, name, found, options).lines()


def get_fields(kind: type) -> set[str]:
    """Names of the fields of a class."""
    return {name for one in kind.__mro__ for name in getattr(one, "__annotations__", {})}


def as_list(lines: list[str], fields: set[str]) -> list[str]:
    """Lines of a docstring, in which `field: text`, with what is indented below it, has become an item of a list."""
    found: list[str] = []
    inside = False
    for line in lines:
        names, colon, text = line.partition(":")
        if colon and names and {name.strip() for name in names.split(",")} <= fields:
            found += [] if inside else [""]
            found.append(f"* ``{names}``: {text.strip()}")
            inside = True
        elif inside and line.startswith(" "):
            found.append(f"  {line.strip()}")
        else:
            inside = False
            found.append(line)
    return found


def _plain_types(app: Sphinx) -> None:
    """Takes from the types of fields what only validation reads (`Annotated`), so that they can be read."""
    del app
    for name in HOME:
        kind = getattr(ma2000, name)
        if inspect.isclass(kind) and "__annotations__" in vars(kind):
            hints = get_type_hints(kind)
            kind.__annotations__ = {field: _without_dtype(hints[field]) for field in kind.__annotations__}


def _without_dtype(kind: Any) -> Any:
    if get_origin(kind) is np.ndarray:
        return np.ndarray
    if get_origin(kind) in (Union, types.UnionType):
        return Union[tuple(_without_dtype(one) for one in get_args(kind))]  # noqa: UP007
    return kind


def _public(app: Sphinx, env: BuildEnvironment, node: addnodes.pending_xref, text: nodes.Element) -> Any:
    """Leads a type that is named by its place in the code to its public name. A type that is not public, or another
    project's, stays text: only signatures name such types."""
    if node.get("refdomain") != "py":
        return None
    target = node.get("reftarget", "")
    public = {f"{module}.{name}": name for name, module in HOME.items()}
    name = public.get(target, target if target in HOME else "")
    if not name:
        return text if node["refdoc"] == PAGE else None
    return env.domains.python_domain.resolve_xref(
        env, node["refdoc"], app.builder, "class" if name[0].isupper() else "func", f"ma2000.{name}", node, text
    )


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the handlers."""
    app.connect("builder-inited", _plain_types)
    app.connect("env-check-consistency", _check)
    app.connect("missing-reference", _public)
    app.connect("autodoc-process-signature", _signature)
    app.connect("autodoc-process-docstring", _docstring)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
