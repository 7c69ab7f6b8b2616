"""Routes of the caller's own layouts. Their text is the page's (`server/dashboard/src/lib/layout`), which checks it."""

from __future__ import annotations

from pydantic import Field

from daq.contracts.service.base import Wire
from daq.contracts.service.robot import Done
from extras.lab.layouts.tables import LayoutsRow
from server.api.dependencies import ServicesDep, Viewer
from server.problems import PROBLEMS
from server.routes import Router

router = Router(prefix="/me/layouts", tags=["system"], responses=PROBLEMS)
LARGEST = 100_000
"""Most characters: some 40 layouts of 40 panels."""


class KeptLayouts(Wire):
    """All layouts of one person. `text`: as the page writes them; empty if none are kept."""

    text: str = Field(max_length=LARGEST)
    name: str = Field("", max_length=80)
    """The name of the layout that is shown: the audit log has it."""


@router.get("")
def get_layouts(services: ServicesDep, caller: Viewer) -> KeptLayouts:
    """Returns the caller's layouts."""
    with services.store.reading() as session:
        row = session.get(LayoutsRow, caller.name)
        return KeptLayouts(text="" if row is None else row.text)


@router.put("")
def put_layouts(kept: KeptLayouts, services: ServicesDep, caller: Viewer) -> Done:
    """Keeps the caller's layouts in place of those kept before."""
    with services.store.writing() as session:
        session.merge(LayoutsRow(person=caller.name, text=kept.text))
    return Done(text=kept.name)
