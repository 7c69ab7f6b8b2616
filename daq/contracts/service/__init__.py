"""Messages between the service and its clients: one model for each resource, the same for server, client and page."""
