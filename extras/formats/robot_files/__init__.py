"""Robots in the formats of others: URDF to machine files; models to URDF, MJCF and actuators; replays in MuJoCo."""

from daq.plugins import Command, Name, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "machine",
            "Write machine files, and models as URDF and MJCF.",
            "extras.formats.robot_files.machine_command",
            about="computer",
        ),
    ),
    routes=("extras.formats.robot_files.meshes:router",),
    sections=("extras.formats.robot_files.replay_section:replay_section",),
    names=(
        Name("machine_from_urdf", "extras.formats.robot_files.machine_of_arm", "robot"),
        Name("write_mjcf", "extras.formats.robot_files.in_python", "model"),
        Name("write_urdf", "extras.formats.robot_files.in_python", "model"),
    ),
)
