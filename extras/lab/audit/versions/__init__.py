"""Migrations of the table of the audit log."""
