"""Messages between the service and its clients: one model per resource, shared by server, client and page."""
