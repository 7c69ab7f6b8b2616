"""Migrations of the table of notifications."""
