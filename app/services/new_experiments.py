"""An experiment as a client describes it, and whether it can be one."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from app.domain import HOLDOUT, Described
from app.errors import Fault, UnusableExperiment
from app.services.policy_catalogue import complete

SURE = 1e-6  # how far from one the sum of shares may be


@dataclass(frozen=True, slots=True)
class NewArm:
    """Users to serve by a policy. `policy`: None: whichever is in force."""

    name: str
    policy: Described | None
    share: float
    note: str = ""


@dataclass(frozen=True, slots=True)
class NewShadow:
    """A policy to decide, too, without being served, at a share of plays."""

    name: str
    policy: Described
    sample: float
    note: str = ""


@dataclass(frozen=True, slots=True)
class NewExperiment:
    """How users are to be split; `control` None: the first arm."""

    name: str
    arms: Sequence[NewArm]
    holdout: float
    control: str | None
    shadows: Sequence[NewShadow]
    note: str

    @property
    def shares(self) -> Mapping[str, float]:
        """The share of each arm, the holdout included; without arms, all of it."""
        if not self.arms:
            return {HOLDOUT: 1.0}
        return {**{arm.name: arm.share for arm in self.arms}, HOLDOUT: self.holdout}

    @property
    def compared_with(self) -> str | None:
        """The arm that others are compared with, None if there is none."""
        return (self.control or self.arms[0].name) if self.arms else None

    def each(self) -> Iterator[tuple[str, int, NewArm | NewShadow]]:
        """Arms and shadows: the field that each is in, and its number there."""
        for number, arm in enumerate(self.arms):
            yield "arms", number, arm
        for number, shadow in enumerate(self.shadows):
            yield "shadows", number, shadow


def check(new: NewExperiment, least: float) -> None:
    """Refuse what is no experiment. `least`: share that an arm must have.

    Raises:
        UnusableExperiment: names each field at fault.
    """
    faults = [*_names(new), *_shares(new, least), *_control(new), *_policies(new)]
    if faults:
        raise UnusableExperiment("Nothing was begun or changed.", *faults)


def _names(new: NewExperiment) -> Iterator[Fault]:
    if not new.arms and not new.shadows:
        yield Fault("arms", "there is neither an arm nor a shadow")
    seen = {("arms", HOLDOUT)}
    for field, number, one in new.each():
        if (field, one.name) in seen:
            taken = "means those in no arm" if one.name == HOLDOUT else "is taken"
            yield Fault(f"{field}.{number}.name", taken, one.name)
        seen.add((field, one.name))


def _shares(new: NewExperiment, least: float) -> Iterator[Fault]:
    if not new.arms:
        return
    if len(new.arms) == 1 and not new.holdout:
        yield Fault("arms", "needs two arms, or one and a holdout")
    for place, arm in enumerate(new.arms):
        if arm.share < least:
            message = f"must be at least {least:g} (ENCORE_EXPERIMENT_LEAST_SHARE)"
            yield Fault(f"arms.{place}.share", message, arm.share)
    if 0 < new.holdout < least:
        message = f"must be 0, or at least {least:g} (ENCORE_EXPERIMENT_LEAST_SHARE)"
        yield Fault("holdout", message, new.holdout)
    total = sum(arm.share for arm in new.arms) + new.holdout
    if abs(total - 1) > SURE:
        yield Fault("arms", f"shares and holdout add up to {total:g}, not to 1")


def _control(new: NewExperiment) -> Iterator[Fault]:
    known = {name for name, share in new.shares.items() if share} if new.arms else set()
    if new.control is not None and new.control not in known:
        yield Fault("control", "is none of the arms", new.control)


def _policies(new: NewExperiment) -> Iterator[Fault]:
    for field, number, one in new.each():
        if one.policy is not None:
            try:
                complete(one.policy.name, one.policy.params)
            except ValueError as error:
                at, _, message = str(error).partition(": ")
                at = at if at == "name" else f"params.{at}"
                yield Fault(f"{field}.{number}.policy.{at}", message)
