"""Layouts of the dashboard's Live page, kept for each person by the service: the same on every computer."""

from daq.plugins import Plugin

PLUGIN = Plugin(
    migrations={"layouts": "extras.lab.layouts.versions"},
    routes=("extras.lab.layouts.routes:router",),
    pages=("layouts",),
)
