"""What an experiment has shown so far: what each arm earns, and whether arms differ."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime

from app.domain import HOLDOUT, Experiment, PolicyVersion
from app.services.experiments import find
from app.services.in_force import find_policy
from app.storage import experiments, policies, revision, shadows, tallies
from app.storage.shadows import ShadowTotal
from app.storage.store import Store
from app.storage.tallies import ArmTotal
from learning import sequential
from learning.sequential import LEVEL, Difference, Estimate, Sums

TOO_FAR = 4.0  # standard errors of a share


@dataclass(frozen=True, slots=True)
class ArmReport:
    """What the users of an arm did.

    policy: None: whichever is in force
    likes:  rewards of answered plays; where signals are skip and like, likes
    moved:  plays that do not count: their users have met another arm before
    rate:   of likes among answered plays, None: nobody can tell
    difference: to the control, at whatever time one looks; None: there is none, or
            too few users have answered
    """

    name: str
    policy: PolicyVersion | None
    share: float
    users: int
    plays: int
    answered: int
    likes: float
    moved: int
    rate: Estimate | None
    difference: Difference | None


@dataclass(frozen=True, slots=True)
class ShadowReport:
    """What a shadow would have chosen.

    agreement: share of decisions for what was served, or its equal
    gain:      expected likes of its choices, less those of what was served
    """

    name: str
    policy: PolicyVersion
    sample: float
    decisions: int
    agreement: Estimate | None
    gain: Estimate | None


@dataclass(frozen=True, slots=True)
class Report:
    """An experiment and its results.

    suspended:     the guard has fallen back, and all users are served by its policy
    counted_until: plays chosen before are all counted, None: none is
    """

    experiment: Experiment
    running: bool
    suspended: bool
    arms: Sequence[ArmReport]
    shadows: Sequence[ShadowReport]
    counted_until: datetime | None
    warnings: Sequence[str]


def report(store: Store, version: int | None) -> Report:
    """The report of a version; None: of the latest one."""
    experiment = find(store, version)
    known = revision.current(store)
    running = experiment.version == known.experiment
    suspended = running and find_policy(store, known.policy).is_fallback
    versions = experiments.versions(store, experiment.origin)
    totals = tallies.totals(store, experiment.origin)
    last = tallies.last(store)
    arms = _arms(store, experiment, versions, totals)
    return Report(
        experiment,
        running,
        suspended,
        arms,
        _shadows(store, experiment),
        None if last is None or last.until < versions[0].at else last.until,
        [*_warnings(store, experiment, versions, arms, suspended=suspended)],
    )


def _arms(
    store: Store,
    experiment: Experiment,
    versions: Sequence[Experiment],
    totals: Mapping[str, ArmTotal],
) -> Sequence[ArmReport]:
    """The arms there are, the holdout, then those that there were before."""
    own = {arm.name: arm.policy for each in versions for arm in each.arms}
    shares = {arm.name: arm.share for arm in experiment.arms}
    if experiment.holdout or HOLDOUT in totals:
        shares[HOLDOUT] = experiment.holdout
    control = totals.get(experiment.control or "")
    level = _level(versions)
    shares |= dict.fromkeys(totals.keys() - shares.keys(), 0.0)
    return [
        _arm(
            find_policy(store, policy) if (policy := own.get(name)) else None,
            share,
            totals.get(name, ArmTotal(experiment.origin, name, 0, 0, 0, {})),
            None if name == experiment.control or not share else control,
            level,
        )
        for name, share in shares.items()
    ]


def _level(versions: Sequence[Experiment]) -> float:
    """That of each comparison, of all that there were.

    Also of arms that have ended: those that are left may be so for their luck.
    """
    names = {arm.name for each in versions for arm in each.arms}
    if any(each.arms and each.holdout for each in versions):
        names.add(HOLDOUT)
    return LEVEL / max(len(names) - 1, 1)


def _arm(
    policy: PolicyVersion | None,
    share: float,
    total: ArmTotal,
    control: ArmTotal | None,
    level: float,
) -> ArmReport:
    sums = Sums(**total.sums)
    compared = None
    if control is not None:
        compared = sequential.difference(sums, Sums(**control.sums), level)
    if compared is not None:  # one of several, any of which may err
        compared = replace(compared, p=min(compared.p * LEVEL / level, 1.0))
    return ArmReport(
        name=total.arm,
        policy=policy,
        share=share,
        users=total.users,
        plays=total.plays,
        answered=round(sums.answered),
        likes=sums.earned,
        moved=total.moved,
        rate=sequential.rate(sums),
        difference=compared,
    )


def _shadows(store: Store, experiment: Experiment) -> Sequence[ShadowReport]:
    found = shadows.by_shadow(store, experiment.origin)
    return [
        _shadow(find_policy(store, one.policy), one.name, one.sample, totals)
        for one in experiment.shadows
        for totals in (found.get(one.name, ()),)
    ]


def _shadow(
    policy: PolicyVersion, name: str, sample: float, totals: Sequence[ShadowTotal]
) -> ShadowReport:
    """A shadow's report; errors are those of totals by part of the users."""
    agreed = gained = Sums()
    for part in totals:
        agreed += sequential.of_user(part.decisions, part.agreed)
        gained += sequential.of_user(part.decisions, part.gained)
    return ShadowReport(
        name,
        policy,
        sample,
        sum(part.decisions for part in totals),
        sequential.rate(agreed),
        sequential.mean(gained),
    )


def _warnings(
    store: Store,
    experiment: Experiment,
    versions: Sequence[Experiment],
    arms: Sequence[ArmReport],
    *,
    suspended: bool,
) -> Iterator[str]:
    if suspended:
        yield "The guard has fallen back: its policy serves all users of all arms."
    yield from _swapped(store, versions[0], experiment.ended_at)
    if len(versions) == 1:  # else users came under several shares
        yield from _uneven(arms)
    if any(arm.moved for arm in arms):
        yield "Users whom a change of shares has moved count by what they did before."


def _swapped(store: Store, first: Experiment, until: datetime | None) -> Iterator[str]:
    """Whether arms without a policy of their own have had several, if only once."""
    began = find_policy(store, first.policy)
    met: list[PolicyVersion] = []
    for one in (began, *policies.after(store, began.version)):
        if one.is_fallback or (until is not None and one.activated_at > until):
            continue
        if met and all((one.name, one.params) != (m.name, m.params) for m in met):
            yield (
                f"Since it began, {one.name} (version {one.version}) has come in force"
                f" for {met[0].name} (version {met[0].version}): users without a"
                " policy of their own have met both."
            )
        met.append(one)


def _uneven(arms: Sequence[ArmReport]) -> Iterator[str]:
    """Arms that hold another share of all users than theirs, by more than chance."""
    users = sum(arm.users for arm in arms)
    for arm in arms:
        error = math.sqrt(users * arm.share * (1 - arm.share))
        if abs(arm.users - users * arm.share) > TOO_FAR * error:
            yield (
                f"{arm.name} has {arm.users} of {users} users, which is not its share:"
                " do not trust the comparison before you know why."
            )
