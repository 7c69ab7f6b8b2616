"""The operator's desk on the page: a console that speaks the command line's language, macros made of its lines, and a
calendar of what the arm will do. Nothing here moves the arm: what is read is submitted through the service's routes."""

from daq.plugins import Plugin

PLUGIN = Plugin(
    migrations={"macros": "extras.console.versions"},
    routes=("extras.console.routes:router",),
    pages=("macros", "plan", "console"),
)
