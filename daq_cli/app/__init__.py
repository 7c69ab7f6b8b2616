"""Common parts of all subcommands: the command itself, its context, output, and questions to a person."""
