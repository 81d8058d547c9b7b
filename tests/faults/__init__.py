"""What goes wrong at three in the morning, done to real processes under load.

`python -m tests.faults --rounds 100` prints a table of all faults; the tests run few
rounds of each.
"""
