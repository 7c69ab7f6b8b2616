"""The state of notifications, to be read: only the configuration says who is told."""

from __future__ import annotations

from typing import Annotated

from daq.contracts.service.notifications import NotificationStatus
from extras.lab.notifications.part import Notifications
from server.api.dependencies import Viewer, part
from server.problems import PROBLEMS
from server.routes import Router

router = Router(tags=["system"], responses=PROBLEMS)


@router.get("/notifications")
def get_notifications(notifications: Annotated[Notifications, part(Notifications)], _: Viewer) -> NotificationStatus:
    """Returns how far the messages to each webhook and each person with e-mail are. The configuration alone says who
    is told; no request can add or change an address."""
    return notifications.notifier.status()
