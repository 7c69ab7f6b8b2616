"""What travels between the service and its clients: one model a resource, the same for server, client and page."""
