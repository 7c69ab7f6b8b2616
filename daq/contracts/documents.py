"""Reads JSON and TOML files written by people as plain data, with limits on size and nesting."""

from __future__ import annotations

import json
import re
import reprlib
import tomllib
from pathlib import Path
from typing import Any

from daq.contracts.errors import SpecError

LARGEST = 64 << 20
"""Size (bytes) of the largest file that is read; a path recorded for an hour has about 20 MB."""
DEEPEST = 64
"""Most levels of nesting. No file here needs 10; parsers, validators and `repr` recurse once per level."""
MOST_KEY_PARTS = 64
"""Most parts of a dotted TOML key (`a.b.c`); the time to read a key grows with the square of their number."""

MOST_BITS = 4096
"""Most bits of an integer; Python cannot write much longer ones as text."""

MARK = "\ufeff"
"""The byte-order mark, which some editors put before a text."""
_LONG_KEY = re.compile(rf"(?:^|[\[{{,])[ \t]*(?:[\w\"'-]+[ \t]*\.[ \t]*){{{MOST_KEY_PARTS}}}", re.MULTILINE)
"""Matches only where a key can begin, so that the search time is proportional to the length of the text."""


_ENCODING = re.compile(rb"""\s*<\?xml[^>]{0,100}?\sencoding\s*=\s*["']([A-Za-z0-9._-]{1,40})["']""")
_HALF = re.compile(r"\\u[dD][89a-fA-F]")


class _Short(reprlib.Repr):
    """Like `reprlib.Repr`, but for integers too long for decimal digits (TOML's 0x…), which Python cannot print."""

    def repr_int(self, x: int, level: int) -> str:
        """Formats an integer, a long one in hexadecimal digits."""
        del level
        if x.bit_length() <= _DECIMAL_BITS:
            return repr(x)
        digits = hex(x)
        return f"{digits[:20]}...{digits[-3:]} ({x.bit_length()} bits)"


_DECIMAL_BITS = 190
"""Bits of the largest integer that is printed in decimal digits; it has 58 of them."""

_LONG_NUMBER = "a whole number has more than a thousand digits"

_short = _Short()
_short.maxstring = _short.maxother = _short.maxlong = 60
_short.maxlevel = 2


def shown(value: object) -> str:
    """Formats a value for an error message, shortened if it is long or deeply nested."""
    return " ".join(_short.repr(value).split())


def read_text(path: Path, what: str, *, xml: bool = False) -> str:
    """Returns the text of a file, which errors call `what`. xml: use the encoding that the first line declares.

    Raises a one-line SpecError if the file cannot be read, has more than LARGEST bytes, or is in another encoding.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(LARGEST + 1)
    except OSError as error:
        raise SpecError(f"{what}: cannot be read: {error.strerror or error}") from error
    except ValueError as error:  # the path contains a NUL
        raise SpecError(f"{what}: cannot be read: {error}") from error
    if len(content) > LARGEST:
        raise SpecError(f"{what}: cannot be read: it is larger than {LARGEST >> 20} MiB")
    declared = _ENCODING.match(content) if xml else None
    encoding = "UTF-8" if declared is None else declared[1].decode("ascii")
    try:
        # Some of Python's decoders take time that grows with the square of the size, so decode the declaration first.
        if declared is not None and declared[0].decode(encoding) != declared[0].decode("ascii"):
            raise SpecError(f"{what}: cannot be read: its first line is not in encoding {shown(encoding)}, as it says")
        return content.decode("utf-8-sig" if encoding.lower() == "utf-8" else encoding)
    except LookupError as error:
        raise SpecError(f"{what}: cannot be read: it declares encoding {shown(encoding)}, which is unknown") from error
    except UnicodeError as error:
        at = error.start if isinstance(error, UnicodeDecodeError) else 0
        line = f"it is not {shown(encoding)[1:-1]} text (byte {content[at]:#04x} at {at})"
        raise SpecError(f"{what}: cannot be read: {line}") from error


def parse_json(text: str, what: str) -> Any:
    """Returns plain data from JSON. Raises a one-line SpecError for text that is not JSON, is nested deeper than
    DEEPEST, or contains an integer of more than MOST_BITS."""
    try:
        data = json.loads(text.removeprefix(MARK))
    except RecursionError:
        raise _too_deep(what) from None
    except ValueError as error:  # also an integer with thousands of digits
        raise SpecError(f"{what}: not JSON: {_plain(error)}") from error
    if _HALF.search(text):  # an unpaired surrogate such as \ud83d is no character and cannot be encoded again
        try:
            json.dumps(data, ensure_ascii=False).encode()
        except (UnicodeEncodeError, RecursionError):
            raise SpecError(f"{what}: not JSON: a text in it has half a character (\\ud800 to \\udfff)") from None
    return _bounded(data, what)


def parse_toml(text: str, what: str) -> dict[str, Any]:
    """Returns plain data from TOML. Raises a one-line SpecError for text that is not TOML, is nested deeper than
    DEEPEST, or contains an integer of more than MOST_BITS."""
    text = text.removeprefix(MARK)
    if _LONG_KEY.search(text):
        raise SpecError(f"{what}: a key has more than {MOST_KEY_PARTS} parts; no key here needs them")
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise _too_deep(what) from None
    except ValueError as error:
        raise SpecError(f"{what}: not TOML: {_plain(error)}") from error
    _bounded(data, what)
    return data


def read_document(path: Path, what: str) -> Any:
    """Returns plain data of a .toml file, or of a JSON file of any other name. Raises a one-line SpecError."""
    text = read_text(path, what)
    return parse_toml(text, what) if path.suffix == ".toml" else parse_json(text, what)


def _plain(error: ValueError) -> str:
    text = str(error)
    return _LONG_NUMBER if "integer string conversion" in text else text


def _too_deep(what: str) -> SpecError:
    return SpecError(f"{what}: it is nested more than {DEEPEST} levels deep")


def _bounded(data: Any, what: str) -> Any:
    """Returns the data unchanged if it is within the limits; works level by level, without recursion. Raises
    SpecError."""
    level = [data]
    for _ in range(DEEPEST + 1):
        parts = [
            part
            for value in level
            if isinstance(value, dict | list)
            for part in (value.values() if isinstance(value, dict) else value)
        ]
        if any(isinstance(part, int) and part.bit_length() > MOST_BITS for part in parts):
            raise SpecError(f"{what}: {_LONG_NUMBER}")
        level = [part for part in parts if isinstance(part, dict | list)]
        if not level:
            return data
    raise _too_deep(what)
