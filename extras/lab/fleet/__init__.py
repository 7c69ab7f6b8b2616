"""Several robots of one service: the same experiment on each, and how their fits change."""

from daq.plugins import Plugin

PLUGIN = Plugin(parts=("extras.lab.fleet.comparison:Comparisons",), routes=("extras.lab.fleet.routes:router",))
