"""Which tests run what the pages show, and what is not run and why."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.environment import BuildEnvironment

DOCS = Path(__file__).parents[1]
BLOCK = re.compile(r"^[ ]*```(python|console)\n(.*?)^[ ]*```$", re.DOTALL | re.MULTILINE)
RUN: Mapping[tuple[str, str], str] = {
    ("any-arm.md", "python"): "tests/extras/formats/command_line/test_pages.py",
    ("audit.md", "console"): "tests/extras/lab/audit/test_requests.py",
    ("batches.md", "console"): "tests/extras/lab/batches/test_batch_command.py",
    ("batches.md", "python"): "tests/extras/lab/batches/test_batch_command.py",
    ("feedforward.md", "python"): "tests/extras/motion/test_command.py",
    ("fleet.md", "console"): "tests/server/fleet/test_fleet_service.py",
    ("fleet.md", "python"): "tests/server/fleet/test_fleet_service.py",
    ("index.md", "python"): "tests/repository/test_documentation.py",
    ("notifications.md", "console"): "tests/extras/lab/notifications/test_service.py",
    ("own-effect.md", "python"): "tests/model/effects/test_effects.py",
    ("python.md", "python"): "tests/ma2000/test_public_interface.py",
    ("robots-from-urdf.md", "python"): "tests/extras/formats/command_line/test_pages.py",
    ("service.md", "console"): "tests/server/api/test_guide.py",
    ("service.md", "python"): "tests/server/api/test_guide.py",
    ("traces.md", "python"): "tests/repository/test_documentation.py",
}
"""The test that runs a page's blocks of a language."""
NOT_RUN: Mapping[tuple[str, str], str] = {
    ("thesis.md", "python"): "takes minutes; tests/extras/thesis/test_reproduction.py makes the same calls",
}
"""Why a page's blocks of a language are not run. That what they import exists is checked all the same."""


def blocks(docs: Path = DOCS) -> Iterator[tuple[str, str, str]]:
    """Page, language and text of every block of Python or of a console. The notebooks of the gallery have none: what
    they show is run while the site is built."""
    for page in sorted(docs.rglob("*.md")):
        name = page.relative_to(docs).as_posix()
        if not name.startswith(("_site/", "gallery/")):
            for language, text in BLOCK.findall(page.read_text("utf-8")):
                yield name, language, text


def wrong(docs: Path = DOCS) -> list[str]:
    """One line for whatever of the pages and of the tables above does not belong together."""
    shown = {(page, language) for page, language, _ in blocks(docs)}
    found = [
        f"{page}: no test runs its {language} blocks: name one in docs/extensions/snippets.py, or say why not"
        for page, language in sorted(shown - set(RUN) - set(NOT_RUN))
    ]
    found += [f"{page}: has no {language} blocks any more" for page, language in sorted({*RUN, *NOT_RUN} - shown)]
    for (page, _), test in RUN.items():
        path = docs.parent / test
        if "extras" in path.parts and not (docs.parent / "tests" / "extras").is_dir():
            continue  # what is optional was taken away
        if not path.is_file() or page not in path.read_text("utf-8"):
            found.append(f"{page}: {test} does not read it")
    return found


def _check(app: Sphinx, env: BuildEnvironment) -> None:
    from sphinx.util import logging  # not above: the tests of the repository read these tables without Sphinx

    del app, env
    for line in wrong():
        logging.getLogger(__name__).warning(line)


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the check."""
    app.connect("env-check-consistency", _check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
