"""Files and numbers that nobody means, for every command that takes one."""

from pathlib import Path

from tests.daq_cli.invoke import Said

MISSING, FOLDER, ENDLESS = "missing", "folder", "endless"
FILES: dict[str, bytes | None] = {
    MISSING: None,
    FOLDER: None,
    ENDLESS: None,
    "empty": b"",
    "binary": bytes(range(256)) * 20,
    "nul": b"{}\0\0\0",
    "latin1": '{"name": "é"} # é'.encode("latin1"),
    "deep-json": b"[" * 100_000 + b"]" * 100_000,
    "deep-objects": b'{"machine": ' * 900 + b"1" + b"}" * 900,
    "deep-toml": b"robot = " + b"[" * 5000 + b"]" * 5000 + b"\n",
    "long-key": b".".join([b"robot"] * 5000) + b" = 1\n",
    "long-number": b'{"trajectory": ' + b"9" * 6000 + b"}",
    "long-number-toml": b"operator = " + b"9" * 6000 + b"\n",
    "long-hexadecimal": b"operator = 0x" + b"f" * 6000 + b"\n",
    "list": b"[1, 2]",
    "null": b"null",
    "no-numbers": b'{"trajectory": NaN, "machine": NaN, "format": NaN}',
    "half-a-character": b'{"notes": "\\ud800", "operator": "\\ud800", "format": 1, "machine": "\\ud800"}',
}
NUMBERS = ("nan", "inf", "-1", "1e400", "1e308", "1e-320", "9" * 6000, "")


def hostile_file(kind: str, suffix: str) -> Path:
    """A file of that kind in the working folder; a link to an endless one, a folder, or nothing at all."""
    path = Path(f"{kind}{suffix}")
    content = FILES[kind]
    if content is not None:
        path.write_bytes(content)
    elif kind == FOLDER:
        path.mkdir()
    elif kind == ENDLESS:
        path.symlink_to("/dev/zero")
    return path


def refuses(said: Said) -> None:
    """It ended as for wrong input, with one line that is no page; below it one for each mistake of a machine file."""
    assert said.code in (2, 3, 4), (said.code, said.err)
    lines = [line for line in said.err.splitlines() if not line.startswith("No robot is configured")]
    assert all(line.startswith("  ") and line.isprintable() for line in lines[1:]), said.err
    assert lines[0].startswith("daq: ")
    assert len(lines[0]) < 1000
    assert lines[0].isprintable()
