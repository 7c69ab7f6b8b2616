"""docs/command-line.md shows no command that an installation of everything lacks."""

from daq_cli.app.subcommands import subcommands
from tests.daq_cli.test_documentation import SHOWN


def test_every_command_that_the_page_shows_is_one() -> None:
    assert {words[0] for words in SHOWN} <= set(subcommands())
