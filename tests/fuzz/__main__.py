"""Many inputs of each decoder, and a table of what came of them."""

import argparse
import secrets
import sys

from tests.fuzz.decoders import DECODERS
from tests.fuzz.trying import crashes


def main() -> None:
    """Try them, and print a table in Markdown; end with 1 if there was a crash."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=secrets.randbits(32))
    parser.add_argument("--decoder", choices=[*DECODERS], action="append")
    options = parser.parse_args()
    print(f"Seed {options.seed}.\n")
    print("| decoder | inputs tried | crashes |\n| --- | --- | --- |", flush=True)
    found = 0
    for name in options.decoder or DECODERS:
        these = crashes(name, options.inputs, options.seed)
        print(f"| {name} | {options.inputs} | {len(these)} |", flush=True)
        for crash in these:
            print(f"{crash.text!r}: {crash.error!r}", file=sys.stderr)
        found += len(these)
    sys.exit(found > 0)


if __name__ == "__main__":
    main()
