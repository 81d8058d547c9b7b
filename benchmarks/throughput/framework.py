"""Encore as `encore serve` runs it alone, but plain requests take the long way too."""

import sys
from unittest.mock import patch

from starlette.types import ASGIApp

from app import main
from app.cli.serve import serve_alone
from app.settings import Settings


def long_way(app: ASGIApp) -> ASGIApp:
    """Stand where the straight way stands, and take nobody out."""
    return app


if __name__ == "__main__":
    with patch.object(main, "Straight", long_way):
        serve_alone(Settings(port=int(sys.argv[1])))
