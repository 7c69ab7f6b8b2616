"""Several robots of one service: the same experiment on each, and changes of their fits."""

from daq.plugins import Plugin

PLUGIN = Plugin(parts=("extras.lab.fleet.comparison:Comparisons",), routes=("extras.lab.fleet.routes:router",))
