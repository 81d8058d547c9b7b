"""Other libraries and Encore before the same simulated listeners.

No part of the package: `requirements.txt` says what it needs beside NumPy and Numba.
"""
