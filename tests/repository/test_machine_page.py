"""docs/machine-file.md says of every field of a machine file what the schema says."""

from __future__ import annotations

from tests.repository.machine_page import PAGE, PARTS, page


def test_the_page_is_what_the_schema_says() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "python -m tests.repository.machine_page writes it"


def test_every_field_has_a_meaning() -> None:
    rows = [line for line in page().splitlines() if line.startswith("| `")]
    expected = {name for part in PARTS for name in part.model_fields if name not in ("kind", "shape")} | {"kind"}
    assert {row.split("`")[1] for row in rows} == expected
    assert [row for row in rows if row.endswith("|  |")] == []
