"""The page of the machine file explains every field of the schema."""

from docs.extensions.machine_file import PARTS, page


def test_every_field_has_a_meaning() -> None:
    rows = [line for line in page().splitlines() if line.startswith("| `")]
    expected = {name for part in PARTS for name in part.model_fields if name not in ("kind", "shape")} | {"kind"}
    assert {row.split("`")[1] for row in rows} == expected
    assert [row for row in rows if row.endswith("|  |")] == []
