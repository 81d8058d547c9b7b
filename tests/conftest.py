"""Before anything is imported: compiled code as new as its source.

Numba keeps compiled code by the file it came from, and does not see that a function of
another file, which it took in, has changed.

A busy machine is no fault of a test: none has to end within a time.
"""

import hashlib
import os
import tempfile
from pathlib import Path

import hypothesis

ROOT = Path(__file__).parent.parent
PACKAGES = ("learning", "policies", "simulation")
SOURCES = sorted(
    source for package in PACKAGES for source in ROOT.glob(f"{package}/**/*.py")
)
DIGEST = hashlib.sha256(b"".join(source.read_bytes() for source in SOURCES))
CACHE = Path(tempfile.gettempdir()) / f"encore-numba-{os.getuid()}-{DIGEST.hexdigest()}"

os.environ.setdefault("NUMBA_CACHE_DIR", str(CACHE))
hypothesis.settings.register_profile("encore", deadline=None)
hypothesis.settings.load_profile("encore")
