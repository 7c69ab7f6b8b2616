"""A package: only then do its fixtures of package scope end with its last test."""
