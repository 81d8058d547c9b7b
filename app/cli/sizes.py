"""Numbers to choose from, as options give them."""

from collections.abc import Sequence

from app.cli.console import Failed

AUTO = "auto"


def sizes(
    option: str, text: str, usual: Sequence[int], least: int, most: int
) -> Sequence[int]:
    """Those of `4`, of `2,3,4` or of `2-6`; of `auto` the usual ones."""
    if text == AUTO:
        return usual
    found: set[int] = set()
    for part in text.split(","):
        first, _, last = part.partition("-")
        if not (first.isdecimal() and (last or first).isdecimal()):
            message = f"{option} {text}: give a number, as 4, 2,3,4 or 2-6, or {AUTO}."
            raise Failed(message, status=2)
        low, high = int(first), int(last or first)
        if not least <= low <= high <= most:
            message = f"{option} {text}: must be from {least} to {most}."
            raise Failed(message, status=2)
        found.update(range(low, high + 1))
    return sorted(found)
