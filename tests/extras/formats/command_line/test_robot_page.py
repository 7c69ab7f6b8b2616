"""docs/robots-from-urdf.md: what it types gives what it shows, and its program runs."""

import re
import shlex
import shutil
from pathlib import Path

from tests.daq_cli.invoke import CommandLine

ROOT = Path(__file__).parents[4]
PAGE = (ROOT / "docs" / "robots-from-urdf.md").read_text("utf-8")
SESSIONS = [block for block in re.findall(r"^```\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE) if "$ daq" in block]


def test_the_page_s_commands_print_what_it_shows(daq: CommandLine) -> None:
    shutil.copy(ROOT / "examples" / "reach_arm.urdf", "reach_arm.urdf")
    commands = [part for session in SESSIONS for part in session.split("$ daq ")[1:]]
    assert len(commands) == 3
    for part in commands:
        line, _, shown = part.partition("\n")
        said = daq(*shlex.split(line))
        assert (said.code, said.err + said.out) == (0, shown)


def test_the_page_s_program_writes_what_the_commands_write(daq: CommandLine) -> None:
    shutil.copy(ROOT / "examples" / "reach_arm.urdf", "reach_arm.urdf")
    (program,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(compile(program, "page", "exec"), {})
    by_program = [Path(name).read_text("utf-8") for name in ("reach.toml", "reach.urdf", "reach.xml")]
    for name in ("reach.toml", "reach.urdf", "reach.xml"):
        Path(name).unlink()
    for part in [part for session in SESSIONS for part in session.split("$ daq ")[1:4]][:3]:
        daq(*shlex.split(part.partition("\n")[0]))
    assert [Path(name).read_text("utf-8") for name in ("reach.toml", "reach.urdf", "reach.xml")] == by_program
