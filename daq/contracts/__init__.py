"""Types that every part of the project shares: pure, validated data. The only I/O is reading files of this package."""
