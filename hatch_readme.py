"""Makes the description that a package index shows of README.md.

An index shows one page: pictures and links of the repository, which are relative, would lead nowhere there. Where the
project has an address, `Repository` among its URLs, they become absolute, as of the version's tag; else they are left
out.
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
LINK = re.compile(rf"\[([^\]]*)\]{RELATIVE}")
PICTURE_TARGET = re.compile(r"(?P<before>!\[[^\]]*\])\((?![a-z][a-z+.-]*:)(?P<path>[^)]*)\)")
"""A relative picture, and its file."""
LINK_TARGET = re.compile(r"(?P<before>(?<!!)\[[^\]]*\])\((?![a-z][a-z+.-]*:)(?P<path>[^)#][^)]*)\)")
"""A relative link, and the file and heading that it names."""


class ReadmeHook(MetadataHookInterface):
    """Gives the package its description."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Sets `readme`."""
        text = (Path(self.root) / "README.md").read_text("utf-8")
        repository = metadata.get("urls", {}).get("Repository")
        text = absolute(text, repository, metadata["version"]) if repository else description(text)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}


def absolute(readme: str, repository: str, version: str) -> str:
    """The text with the addresses of relative pictures and links at the tag of a version, in the form of GitHub."""
    place = repository.rstrip("/")
    pictured = PICTURE_TARGET.sub(rf"\g<before>({place}/raw/v{version}/\g<path>)", readme)
    return LINK_TARGET.sub(rf"\g<before>({place}/blob/v{version}/\g<path>)", pictured)


def description(readme: str) -> str:
    """The text without relative pictures; of relative links, the words remain."""
    return LINK.sub(r"\1", PICTURE.sub("", readme))
