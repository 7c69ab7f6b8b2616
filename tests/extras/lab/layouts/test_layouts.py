"""Each person has layouts of their own."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from extras.lab.layouts.routes import KeptLayouts, get_layouts, put_layouts
from server.access.caller import LOCAL
from tests.server.migrated import migrated_store


def test_layouts_are_kept_for_each_person(tmp_path: Path) -> None:
    store = migrated_store(tmp_path / "service.sqlite")
    services: Any = SimpleNamespace(store=store)
    ada: Any = SimpleNamespace(name="ada")
    assert get_layouts(services, ada).text == ""
    put_layouts(KeptLayouts(text="{}"), services, ada)
    kept = KeptLayouts(text='{"chosen":"Bench"}', name="Bench")
    assert put_layouts(kept, services, ada).text == "Bench"  # which the audit log has, and not all of them
    assert get_layouts(services, ada).text == '{"chosen":"Bench"}'
    assert get_layouts(services, LOCAL).text == ""
    store.close()
