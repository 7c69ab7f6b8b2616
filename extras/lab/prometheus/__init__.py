"""Metrics for Prometheus: counts, and the state of the service at each request."""

from daq.plugins import Plugin

PLUGIN = Plugin(
    parts=("extras.lab.prometheus.part:Prometheus",),
    routes_at_root=("extras.lab.prometheus.part:router",),
)
