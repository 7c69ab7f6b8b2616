"""Commands for maintainers. They are not installed."""
