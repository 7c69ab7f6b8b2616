"""The routes, one file per resource. A route translates between HTTP and the services, which do the work."""
