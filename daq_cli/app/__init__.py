"""What every subcommand shares: the command itself, its context, its output, and the questions to a person."""
