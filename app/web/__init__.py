"""Pages for people: everything they load comes from this service."""
