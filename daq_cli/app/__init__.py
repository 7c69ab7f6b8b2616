"""What every subcommand stands on: the command itself, its context, its output, and what a person is asked."""
