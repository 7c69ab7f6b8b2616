"""The same study of many traces, with a table as its result. Another program can go on where one ended."""
