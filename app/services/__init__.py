"""What the service does: plain functions of a store, and decisions taken in them."""
