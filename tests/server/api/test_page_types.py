"""The page's types of the API are those of the service."""

from pathlib import Path

import hatch_build


def test_the_types_are_in_step_with_the_api(tmp_path: Path) -> None:
    made = tmp_path / "schema.d.ts"
    hatch_build.write_types(made)
    assert made.read_text("utf-8") == hatch_build.SCHEMA.read_text("utf-8"), "the API has changed: make types"
