"""Subcommands with `--server`: the robot is a service's; everything else is as with a local robot."""
