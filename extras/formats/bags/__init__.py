"""Recordings of ROS: joint states in bags of ROS 2 (MCAP and SQLite) and ROS 1."""

from daq.plugins import Importer, Plugin

PLUGIN = Plugin(
    importers=(
        Importer(
            "the joint states in a bag",
            "extras.formats.bags.bag_files:is_bag",
            "extras.formats.bags.bag_process:import_bag_apart",
        ),
    )
)
