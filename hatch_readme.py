"""Makes the description that a package index shows of README.md, without what only a checkout has.

An index shows one page: pictures and links of the repository, which are relative, would lead nowhere there.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

RELATIVE = r"\((?![a-z][a-z+.-]*:)[^)]*\)"
"""Target of a link or picture without a scheme such as https."""
PICTURE = re.compile(rf"^!\[[^\]]*\]{RELATIVE}\n+(?:\*[^*\n]+\*\n+)?", re.MULTILINE)
"""A picture in a paragraph of its own, with its caption in italics."""
PAGES = re.compile(r"^\| page \|.*\n(?:\|.*\n)+", re.MULTILINE)
"""The table of the documents."""
LINK = re.compile(rf"\[([^\]]*)\]{RELATIVE}")


class ReadmeHook(MetadataHookInterface):
    """Gives the package its description."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Sets `readme`."""
        text = (Path(self.root) / "README.md").read_text("utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": description(text)}


def description(readme: str) -> str:
    """The text without relative pictures and the table of pages; of relative links, the words remain."""
    text = PAGES.sub("The pages are in the folder `docs` of the source distribution.\n", PICTURE.sub("", readme))
    return LINK.sub(r"\1", text)
