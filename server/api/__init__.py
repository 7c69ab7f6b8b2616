"""The routes, one file a resource. A route translates; what it asks for is done elsewhere."""
