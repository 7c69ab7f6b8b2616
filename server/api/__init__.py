"""The routes, one file a resource. A route translates between HTTP and the services; the work is done elsewhere."""
