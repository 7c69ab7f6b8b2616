"""Access control: tokens, roles, one-time tickets, limits, and protection from requests of other pages in a browser."""
