"""Metrics for Prometheus: counts, and the state of the service whenever it asks."""

from daq.plugins import Plugin

PLUGIN = Plugin(
    parts=("extras.lab.prometheus.part:Prometheus",),
    routes_at_root=("extras.lab.prometheus.part:router",),
)
