"""The HTTP interface: names of things, forms of requests, one call into a service."""
