"""Many answers at once: one order, one outcome."""

from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest

from tests.app.service import Service
from tests.catalogues import paper_example
from tests.filter import Filter

THREADS = 16


def test_one_of_many_answers_to_one_play_wins(example: Service) -> None:
    play = example.next("ann")
    signals = ["like", "skip"] * (THREADS // 2)

    answers = in_parallel(example, [(play["play"], signal) for signal in signals])

    won = [answer.json() for answer in answers if answer.status_code == 200]
    lost = [answer.json() for answer in answers if answer.status_code == 409]
    assert len(won) == len(lost) == THREADS // 2
    assert len({answer["signal"] for answer in won}) == 1
    assert {answer["slot"] for answer in won} == {1}
    assert Counter(answer["repeated"] for answer in won) == {True: 7, False: 1}
    assert {answer["code"] for answer in lost} == {"feedback_conflict"}
    moved_once(example, play["item"], won[0]["signal"])


def test_many_requests_of_a_new_user_open_one_play(example: Service) -> None:
    with ThreadPoolExecutor(THREADS) as threads:
        plays = list(threads.map(lambda _: example.next("ann"), range(THREADS)))

    assert len({play["play"] for play in plays}) == 1
    assert Counter(play["pending"] for play in plays) == {True: THREADS - 1, False: 1}


def test_reports_with_one_key_are_one_play(example: Service) -> None:
    def report(_: int) -> httpx.Response:
        return example.client.post(
            "/v1/users/ann/plays",
            json={"item": "item-1", "signal": "like"},
            headers={"Idempotency-Key": "the-same"},
        )

    with ThreadPoolExecutor(THREADS) as threads:
        answers = list(threads.map(report, range(THREADS)))

    assert Counter(answer.status_code for answer in answers) == {200: 15, 201: 1}
    assert len({answer.json()["play"] for answer in answers}) == 1
    moved_once(example, "item-1", "like")


def test_users_do_not_wait_for_one_another(example: Service) -> None:
    def listen(user: str) -> int:
        play = example.next(user)
        for signal in ("like", "skip", "none", "like"):
            play = example.answer(play["play"], signal, next=True)["next"]
        return int(play["slot"])

    with ThreadPoolExecutor(THREADS) as threads:
        slots = list(threads.map(listen, [f"user-{n}" for n in range(2 * THREADS)]))

    assert slots == [4] * (2 * THREADS)


def in_parallel(
    service: Service, answers: list[tuple[str, str]]
) -> list[httpx.Response]:
    def send(answer: tuple[str, str]) -> httpx.Response:
        play, signal = answer
        return service.client.post(
            f"/v1/plays/{play}/feedback", json={"signal": signal}
        )

    with ThreadPoolExecutor(len(answers)) as threads:
        return list(threads.map(send, answers))


def moved_once(service: Service, item: str, signal: str) -> None:
    oracle = Filter(paper_example(2))
    oracle.take(item, signal)
    held = service.beliefs("ann")
    assert held["slot"] == 1
    [belief] = held["beliefs"]
    assert belief["item"] == item
    assert belief["belief"] == pytest.approx(oracle.beliefs[item], abs=1e-12)
