"""What a user installs is whole: the code, the data files that the code reads, and the dashboard's built page."""

import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

from daq.config.documents import BROUGHT
from hatch_readme import absolute
from tests.repository.tracked import ROOT, tracked_files

PAGE = "server/dashboard/"
NOT_INSTALLED = (PAGE, "firmware_protocol/bridge/")
"""What the page and the bridges on boards are built from."""
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]


def test_the_wheel_holds_every_tracked_file_of_the_packages(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True, timeout=100)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        packed = set(archive.namelist())
        (metadata,) = (archive.read(name).decode() for name in packed if name.endswith(".dist-info/METADATA"))
    tracked = {str(path.relative_to(ROOT)) for path in tracked_files()}
    expected = {name for name in tracked if name.startswith(tuple(f"{package}/" for package in PACKAGES))}
    expected -= {name for name in expected if name.startswith(NOT_INSTALLED)}
    assert {Path(name).suffix for name in expected} >= {".py", ".toml", ".msg"}
    assert expected - packed == set()
    examples = {f"ma2000/{name}" for name in tracked if name.startswith("examples/")}
    assert {name for name in packed if name.startswith("ma2000/examples/")} == examples != set()
    assert not any(name.startswith("tests/") for name in packed)
    page = {name.removeprefix(PAGE) for name in packed if name.startswith(PAGE)}
    assert "dist/index.html" in page
    for form in (".js.gz", ".js.br"):
        assert any(name.startswith("dist/assets/") and name.endswith(form) for name in page)
    assert not any("node_modules" in name or name.startswith("src/") for name in page)
    _, _, description = metadata.partition("\n\n")
    assert description.startswith("# MA2000 DAQ\n")
    assert re.findall(r"\]\((?!https?:)[^)]*\)|<img", description) == [], "an index shows no file of the repository"
    built = (ROOT / "docs" / "_site" / "index.html").is_file()
    assert ("ma2000/docs_site/index.html" in packed) == built
    documents = {name.removeprefix("ma2000/documents/") for name in packed if name.startswith("ma2000/documents/")}
    pages = {name for name in tracked if name.startswith("docs/") and name.endswith((".md", ".png", ".svg"))}
    assert documents == (set() if built else pages | ({"README.md", *BROUGHT.values()} - expected))


def test_where_the_project_has_an_address_the_description_keeps_its_pictures_and_pages() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    text = absolute(readme, "https://example.org/us/arm/", "9.8.7")
    targets = re.findall(r"\]\(([^)]*)\)", text)
    assert len(targets) == len(re.findall(r"\]\(([^)]*)\)", readme))
    assert [target for target in targets if not target.startswith("https://")] == []
    own = [target for target in targets if target.startswith("https://example.org/us/arm/")]
    assert "https://example.org/us/arm/raw/v9.8.7/docs/images/dashboard-live.png" in own
    assert "https://example.org/us/arm/blob/v9.8.7/docs/how-well.md" in own
    for target in own:
        assert (ROOT / re.sub(r".*?/v9\.8\.7/", "", target).partition("#")[0]).exists(), target
