"""The pages of the service's API, from its own OpenAPI description."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

from server.api.documented import PROBLEM_EXAMPLES
from server.app import bare_app

from .command_line import plain

OPERATIONS = """# REST

Made from the service's own description of its API, which a running service gives at `/api/v1/openapi.json`; its page at
`/api/docs` also tries what only reads. [Service](../service.md) explains tokens, control, idempotency and the
[form of an error](../service.md#problems). [Problems](#problems) lists every kind. [Schemas](rest-schemas.md) has every
field.
"""
SCHEMAS = """# REST: schemas

Made from the service's own description of its API. [REST](rest.md) lists the operations that take and return these.
"""


@cache
def _description() -> dict[str, Any]:
    return bare_app(None).openapi()


def operations_page() -> str:
    """Every operation, by the part of the API that it belongs to."""
    parts: dict[str, list[str]] = {}
    for path, methods in _description()["paths"].items():
        for method, operation in methods.items():
            (tag,) = operation.get("tags", ["others"])
            parts.setdefault(tag, []).append("\n".join(_operation(path, method, operation)))
    return "\n".join([OPERATIONS, *(f"## {tag}\n\n" + "\n".join(parts[tag]) for tag in parts), *_problems()])


def _problems() -> Iterator[str]:
    """Every kind of problem, as the service words it in an example."""
    yield "## Problems\n\n| kind | status | for example | advice |\n|---|---|---|---|"
    for one in (example.problem for example in PROBLEM_EXAMPLES):
        yield f"| `{one.kind}` | {one.status} | {plain(one.detail)} | {plain(one.advice)} |"


def _operation(path: str, method: str, operation: dict[str, Any]) -> Iterator[str]:
    yield f"### {operation['operationId']}\n"
    yield f"`{method.upper()} {path}`\n"
    yield f"{plain(operation.get('description', operation.get('summary', '')))}\n"
    for one in operation.get("parameters", []):
        needed = ", needed" if one.get("required") else ""
        text = plain(one.get("description", ""))
        yield f"`{one['name']}` ({one['in']}{needed})\n: {_kind(one['schema'])}{f'. {text}' if text else ''}\n"
    body = operation.get("requestBody", {}).get("content", {})
    for media, content in body.items():
        yield f"body\n: {_kind(content.get('schema', {})) or media}{'' if media.endswith('json') else f' ({media})'}\n"
    for status, answer in operation["responses"].items():
        if status < "300":
            kinds = [_kind(content.get("schema", {})) or media for media, content in answer.get("content", {}).items()]
            yield f"{status}\n: {', '.join(kinds) or plain(answer['description'])}\n"


def schemas_page() -> str:
    """Every schema with its fields."""
    schemas = _description()["components"]["schemas"]
    return "\n".join([SCHEMAS, *(line for name in sorted(schemas) for line in _schema(name, schemas[name]))])


def _schema(name: str, schema: dict[str, Any]) -> Iterator[str]:
    yield f"({_label(name)})=\n## {name}\n"
    if "description" in schema:
        yield f"{plain(' '.join(schema['description'].split()))}\n"
    if "properties" not in schema:
        yield f"{_kind(schema)}\n"
    for field, kind in schema.get("properties", {}).items():
        said = [f"{plain(' '.join(kind['description'].split())).rstrip('.')}." if "description" in kind else ""]
        if field in schema.get("required", ()):
            said.append("Needed.")
        elif kind.get("default") not in (None, "", [], {}):
            said.append(f"By default `{kind['default']}`.")
        yield f"`{field}`\n: {' '.join([f'{_kind(kind)}.', *filter(None, said)])}\n"


def _kind(schema: dict[str, Any]) -> str:
    """What a value may be, in words; schemas by name are links."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"{{ref}}`{name} <{_label(name)}>`"
    for choice in ("anyOf", "oneOf", "allOf"):
        if choice in schema:
            return " or ".join(dict.fromkeys(_kind(one) for one in schema[choice]))
    if "const" in schema:
        return f"`{schema['const']}`"
    if "enum" in schema:
        return " or ".join(f"`{one}`" for one in schema["enum"])
    return _plain_kind(schema)


def _plain_kind(schema: dict[str, Any]) -> str:
    """What a value without choices may be."""
    kind = schema.get("type", "")
    if kind == "array":
        inner = _kind(schema.get("items", {}))
        if "prefixItems" in schema:
            inner = ", ".join(dict.fromkeys(_kind(one) for one in schema["prefixItems"]))
        return f"list of {inner or 'anything'}"
    if kind == "object":
        values = schema.get("additionalProperties")
        return f"object of {_kind(values)} by name" if isinstance(values, dict) and values else "object"
    limits = [
        f"{words} {schema[key]:.6g}" if isinstance(schema[key], float) else f"{words} {schema[key]}"
        for key, words in (
            ("minimum", "from"),
            ("exclusiveMinimum", "over"),
            ("maximum", "to"),
            ("exclusiveMaximum", "below"),
            ("maxLength", "up to"),
        )
        if key in schema and not (key == "maxLength" and kind != "string")
    ]
    characters = " characters" if "maxLength" in schema else ""
    form = f" ({schema['format']})" if "format" in schema else ""
    return " ".join([f"{kind or 'anything'}{form}", *limits]) + characters


def _label(name: str) -> str:
    return f"schema-{name.strip('_').replace('_', '-').lower()}"
