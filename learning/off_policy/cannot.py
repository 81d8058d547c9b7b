"""Why a log cannot answer."""

from enum import StrEnum


class Reason(StrEnum):
    """Codes, which stay what they are."""

    NO_PROPENSITIES = "no_propensities"
    BAD_PROPENSITIES = "bad_propensities"
    TOO_FEW_PLAYS = "too_few_plays"
    TOO_FEW_USERS = "too_few_users"
    DETERMINISTIC_LOG = "deterministic_log"
    NOT_UNIFORM = "not_uniform"
    FEW_EFFECTIVE = "few_effective"
    UNSUPPORTED = "unsupported"
    WRONG_PROPENSITIES = "wrong_propensities"


class CannotAnswer(Exception):
    """A log does not hold what it takes.

    Attributes:
        reason: code.
        detail: what was found, and what would do.
    """

    def __init__(self, reason: Reason, detail: str) -> None:
        super().__init__(f"{reason}: {detail}")
        self.reason = reason
        self.detail = detail
