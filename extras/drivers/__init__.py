"""Python drivers of robots that others have described."""

from daq.plugins import Plugin

PLUGIN = Plugin(drivers={"lerobot": "extras.drivers.lerobot_robot:lerobot_robot"})
