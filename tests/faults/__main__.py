"""Many rounds of each fault, and a table of what came of them."""

import argparse
import json
import statistics
import tempfile
from dataclasses import asdict
from pathlib import Path

from policies import warm_up
from tests.faults.faults import FAULTS
from tests.faults.outcome import Outcome

COLUMNS = (
    "fault",
    "rounds",
    "acknowledged",
    "lost",
    "doubled",
    "seconds to recover: median",
    "most",
    "errors met",
)


def main() -> None:
    """Do them, and print a table in Markdown, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--fault", choices=[*FAULTS], action="append")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    warm_up()  # once, not in each process
    if not options.json:
        print(_row(*COLUMNS), _row(*("---" for _ in COLUMNS)), sep="\n", flush=True)
    for name in options.fault or FAULTS:
        with tempfile.TemporaryDirectory(prefix="encore-faults-") as folder:
            found = FAULTS[name](options.rounds, Path(folder))
        if options.json:
            print(json.dumps(asdict(found)), flush=True)
        else:
            print(_told(found), flush=True)
        found.check()


def _told(found: Outcome) -> str:
    errors = ", ".join(f"{count} {error}" for error, count in found.errors.items())
    return _row(
        found.fault,
        str(len(found.recovered)),
        str(found.acknowledged),
        str(found.lost),
        str(found.doubled),
        f"{statistics.median(found.recovered):.2f}",
        f"{max(found.recovered):.2f}",
        errors or "none",
    )


def _row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
