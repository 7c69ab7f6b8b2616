"""Migrations of the table of the archive."""
