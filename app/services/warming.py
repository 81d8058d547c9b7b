"""Compiles the decision code ahead of the first request."""

from policies import warm_up

__all__ = ["warm_up"]
