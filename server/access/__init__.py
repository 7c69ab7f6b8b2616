"""Access control: tokens, roles, one-time tickets, limits, and protection from requests of other web pages."""
