"""Answers the host: requests in, replies out, on the board's time. No sockets and no clock of its own."""
