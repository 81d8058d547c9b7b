"""Whatever bytes come in, decoders read them or refuse them, and nothing else.

`python -m tests.fuzz --inputs 100000` tries as many as you like of each decoder, and
prints how many; the tests try few.
"""
