"""A plug-in: reads a laboratory's own log files, and counts the robots of a service. It only describes what it adds."""

from daq.plugins import Command, Importer, Plugin

PLUGIN = Plugin(
    commands=(Command("lab-log", "Show the rows of a laboratory's log.", "lab_log.command", about="computer"),),
    importers=(Importer("a laboratory's log", "lab_log.log:is_log", "lab_log.log:read"),),
    routes=("lab_log.routes:router",),
    routes_at_root=("lab_log.panel:router",),
    panels={"Largest error": "lab-log/panel.js"},
)
