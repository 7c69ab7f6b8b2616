"""Subcommands with `--server`: the robot belongs to a service; all else is as with a local robot."""
