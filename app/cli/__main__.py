"""`python -m app.cli`: the command, where it is not installed."""

from app.cli import main

if __name__ == "__main__":  # a process that it starts imports it too
    main()
