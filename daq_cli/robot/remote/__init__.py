"""What subcommands do with `--server`: the robot is a service's, everything else is as with a robot of one's own."""
