"""Which parameter moves which joint, and when."""
