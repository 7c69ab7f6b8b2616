"""Migrations of the table of people."""
