"""The database, in which queue and catalogue survive a restart. Its URL may name another database than SQLite."""
