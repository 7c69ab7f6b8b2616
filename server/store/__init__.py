"""The database: queue and catalogue survive a restart. Its URL is the seam for another one than SQLite."""
