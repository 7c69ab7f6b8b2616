"""Migrations of the table of the layouts."""
