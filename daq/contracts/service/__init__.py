"""Messages between the service and its clients: one model per resource, used by server, client and page."""
