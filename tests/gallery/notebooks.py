"""The notebooks of docs/gallery, as tests read and run them."""

import os
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "gallery"
NAMES = tuple(sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "index"))
OF_EXTRAS = {"thesis-chapters-6-and-7"} if not (ROOT / "extras").exists() else set()
"""Those that cannot run, because they use extras and there are none."""
LONGEST_CELL = 600.0
"""Time limit (s) of one cell, as for the site: a net for one that hangs. On two quiet cores a whole notebook takes less
than a minute."""


def notebook(name: str) -> Any:
    """A notebook of the gallery, without outputs."""
    import jupytext

    return jupytext.read(FOLDER / f"{name}.md")


def code_of(found: Any) -> list[str]:
    """The sources of its cells of code."""
    return [cell.source for cell in found.cells if cell.cell_type == "code"]


def executed(found: Any, folder: Path, environment: dict[str, str] | None = None) -> Any:
    """The same, run by a kernel of its own in `folder`. Raises CellExecutionError."""
    from nbclient import NotebookClient

    own = {name: value for name, value in os.environ.items() if not name.startswith("DAQ_")}
    own |= {"PYTHONPATH": str(ROOT), "XDG_CONFIG_HOME": str(folder)} | (environment or {})
    client = NotebookClient(
        found, timeout=LONGEST_CELL, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    )
    return client.execute(env=own)


def outputs_of(found: Any) -> list[Any]:
    """Every output of its cells of code."""
    return [output for cell in found.cells if cell.cell_type == "code" for output in cell.outputs]


def printed(found: Any) -> str:
    """All that it printed."""
    return "".join(output.text for output in outputs_of(found) if output.output_type == "stream")
