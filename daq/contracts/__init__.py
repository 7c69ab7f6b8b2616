"""The types that every part of the project shares: pure data, validated, no I/O beyond the files that ship with it."""
