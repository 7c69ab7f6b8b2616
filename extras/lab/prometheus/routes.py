"""The route that Prometheus asks."""

from __future__ import annotations

from fastapi import Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest

from extras.lab.prometheus.part import Prometheus
from server.api.dependencies import ServicesDep, Viewer
from server.routes import Router

router = Router(tags=["system"])


@router.get("/metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
def metrics(services: ServicesDep, _: Viewer) -> Response:
    """Returns the metrics in the format of Prometheus."""
    return Response(generate_latest(services.part(Prometheus).registry), media_type=CONTENT_TYPE_LATEST)
