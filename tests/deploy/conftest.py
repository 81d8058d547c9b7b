"""The databases and services of the other tests."""

from tests.app.conftest import _compiled, postgres, postgres_url, sqlite_template

__all__ = ["_compiled", "postgres", "postgres_url", "sqlite_template"]
