"""A simulated listener as a Gymnasium environment, for reinforcement learning.

Needs the extra `gym`. Importing this module registers the paper's examples as
`Encore/Example1-v0` to `Encore/Example3-v0`; `gymnasium.make` imports it by itself for
`simulation.gym:Encore/Example1-v0`.
"""

from typing import Any, Literal, TypeAlias, get_args

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import InvalidAction, ResetNeeded

from policies import NONE, Floats, Situation
from simulation.course import slots_of
from simulation.examples import DISCOUNT, NUMBERS, example
from simulation.listeners import Listeners
from simulation.listening import begun

Start: TypeAlias = Literal["belief", "state"]
Score: TypeAlias = Literal["expected", "clicks"]
Observed: TypeAlias = Literal["belief", "signals"]


class ListeningEnv(gymnasium.Env[Any, np.int64]):
    """A listener who is played one of N items in every slot.

    The hidden states of the listener move and answer by the true models; a belief
    follows the answers by the models believed in. An episode never terminates: it is
    truncated, so that what would come after it still counts.

    Actions: number of the item to play, from 0. Items of a group follow one another.

    Observations: either `belief`, (N, S), by the exact filter. Or `signals`, what a
    client sees: a dictionary of `signal`, (N,), the answer to the last play of each
    item, counted from 1, or 0 if there was none; and `rested`, (N,), slots since that
    play, or since the start. Where models have a mood, its class, `mood`, is observed,
    too, as the models believed in have it; `belief` is then in a dictionary with it.

    Rewards: what the answer is worth, or what was to be expected of the play by one who
    knows the true models and the true start, as `listeners` say. Their mean is the
    same.

    Information: `slot`; `signal`, of the play, or -1; `belief`; and what no policy may
    know: `expected`, (N,), the reward to be expected of each item now, by one who knows
    as much as above; `state`, (N,), the hidden states.
    """

    def __init__(
        self,
        start: Situation,
        listeners: Listeners | None = None,
        *,
        slots: int,
        observation: Observed = "belief",
    ) -> None:
        """Check.

        Args:
            start: of every episode; one item is played in a slot.
            listeners: what is true of the listener; None: what is believed at the
                start.
            slots: length of an episode.
            observation: see the class.

        Raises:
            ValueError: there are no items or no slots, or several items are to be
                played in a slot, or the observation is unknown; or the listeners do
                not answer to the items.
        """
        if len(start.model) == 0 or start.slate.plays != 1:
            raise ValueError("start: must hold items, of which one is played in a slot")
        if slots < 1:
            raise ValueError(f"slots: must be at least 1, not {slots}")
        _check("observation", observation, Observed)
        self._start = start
        self._listeners = listeners or Listeners.believed(start)
        self._slot = self._slots = slots
        self._observed = observation
        self._now = begun(start, self._listeners, self.np_random)
        self.action_space = spaces.Discrete(len(self.situation.model))
        self.observation_space = self._space()

    @property
    def situation(self) -> Situation:
        """What a policy of Encore scores: the items, each a group of its own."""
        return self._now.situation

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin with a new listener; there are no options."""
        super().reset(seed=seed, options=options)
        self._slot = 0
        self._now = begun(self._start, self._listeners, self.np_random)
        return self._observation(), self._information(NONE)

    def step(
        self, action: int | np.int64
    ) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Play an item, and let the slot pass.

        Raises:
            InvalidAction: there is no such item.
            ResetNeeded: the episode has not begun, or is over.
        """
        if not self.action_space.contains(action):
            raise InvalidAction(f"action: {action!r} is not in {self.action_space}")
        if self._slot == self._slots:
            raise ResetNeeded("The episode has not begun, or is over: call reset.")
        item, now = int(action), self._now
        signal = now.answer(item, self.np_random)
        self._now = now.after(item, signal, self.np_random)
        self._slot += 1
        return (
            self._observation(),
            now.reward(item, signal),
            False,
            self._slot == self._slots,
            self._information(signal),
        )

    def _space(self) -> spaces.Space[Any]:
        items, seen = self.situation, dict[str, spaces.Space[Any]]()
        if items.models.classes > 1:
            seen["mood"] = spaces.Discrete(items.models.classes)
        if self._observed == "belief":
            belief = spaces.Box(0.0, 1.0, items.belief.shape, np.float64)
            return spaces.Dict({"belief": belief} | seen) if seen else belief
        signals = items.models.signals[items.model]
        seen["signal"] = spaces.MultiDiscrete(1 + signals)
        seen["rested"] = spaces.Box(0, self._slots, signals.shape, np.int64)
        return spaces.Dict(seen)

    def _observation(self) -> Floats | dict[str, Any]:
        items, seen = self.situation, dict[str, Any]()
        if items.models.classes > 1:
            seen["mood"] = np.int64(items.mood_class)
        if self._observed == "belief":
            # Rounding may leave a certain state with a little more than 1.
            belief = np.minimum(items.belief, 1.0)
            return {"belief": belief, **seen} if seen else belief
        since = np.minimum(items.rested, self._slot)
        return {"signal": self._now.last - NONE, "rested": since, **seen}

    def _information(self, signal: int) -> dict[str, Any]:
        return {
            "slot": self._slot,
            "signal": signal,
            "belief": self.situation.belief.copy(),
            "expected": self._now.expected,
            "state": self._now.state.copy(),
        }


def of_example(
    number: int,
    *,
    start: Start = "belief",
    score: Score = "expected",
    observation: Observed = "belief",
    slots: int = slots_of(DISCOUNT),
) -> ListeningEnv:
    """Return a listener of an example of the paper.

    Args:
        number: of the example, 1 to 3.
        start: whether hidden states at the start follow the beliefs, or are the
            paper's, which contradict them.
        score: whether a play earns what is expected of it, or what is answered.
        observation: see `ListeningEnv`.
        slots: length of an episode.

    Raises:
        ValueError: names the argument at fault.
    """
    _check("start", start, Start)
    _check("score", score, Score)
    paper, clicks = example(number), score == "clicks"
    opening = paper.start
    if start == "state":
        listeners = paper.in_states(opening, clicks=clicks)
    else:
        listeners = Listeners.believed(opening, clicks=clicks)
    return ListeningEnv(opening, listeners, slots=slots, observation=observation)


def _check(name: str, given: str, kind: object) -> None:
    """Check a name that may come from `gymnasium.make`, which checks nothing."""
    if given not in get_args(kind):
        raise ValueError(f"{name}: must be one of {get_args(kind)}, not {given!r}")


for _number in NUMBERS:
    gymnasium.register(
        f"Encore/Example{_number}-v0",
        entry_point="simulation.gym:of_example",
        kwargs={"number": _number},
    )
