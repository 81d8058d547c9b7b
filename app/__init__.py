"""The Encore service."""
