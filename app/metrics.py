"""What the service counts for Prometheus."""

from functools import cache

from prometheus_client import (
    Counter,
    Gauge,
    Histogram,
    Summary,
    disable_created_metrics,
)

disable_created_metrics()  # type: ignore[no-untyped-call]

REQUESTS = Histogram(
    "encore_request_seconds",
    "Time to answer a request",
    ["method", "route", "status"],
    buckets=(0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10),
)
DECISIONS = Histogram(
    "encore_decision_seconds",
    "Time to choose an item",
    ["policy"],
    buckets=(1e-5, 2.5e-5, 5e-5, 1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 1e-2, 0.1, 1),
)
FEEDBACK = Counter(
    "encore_feedback", "Plays closed, by their answer", ["signal", "source"]
)
SURPRISE = Summary(
    "encore_surprise_nats",
    "Negative log likelihood of answers: the lower its mean, the better the models",
    ["policy"],
)
IMPOSSIBLE = Counter(
    "encore_impossible_answers", "Answers to which the model gave no chance"
)
PENDING = Gauge(
    "encore_pending_plays",
    "Plays that wait for their answer",
    multiprocess_mode="mostrecent",
)

INDEX_BUILDS = Histogram(
    "encore_index_build_seconds",
    "Time to build an index table",
    buckets=(0.01, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60, 300),
)
INDEX_TABLES_WAITING = Gauge(
    "encore_index_tables_waiting",
    "Full index tables that are wanted, and not there yet",
    multiprocess_mode="mostrecent",
)

GUARD_LOSS = Gauge(
    "encore_guard_loss_nats",
    "Mean log loss of a model's predictions, and of simple ones of the same answers",
    ["model", "predictor"],
    multiprocess_mode="mostrecent",
)
GUARD_CALIBRATION = Gauge(
    "encore_guard_calibration_error",
    "Mean distance of predictions to what was answered, in ten classes",
    ["model"],
    multiprocess_mode="mostrecent",
)
GUARD_ALARM = Gauge(
    "encore_guard_alarm",
    "Whether a model predicts worse than a simple rate",
    ["model"],
    multiprocess_mode="mostrecent",
)
GUARD_FALLS = Counter(
    "encore_guard_falls", "Times that the guard replaced the policy in force"
)

METHODS = {"DELETE", "GET", "HEAD", "OPTIONS", "PATCH", "POST", "PUT"}

# Labels are looked up once, then kept: that halves the cost of an observation.
decisions = cache(DECISIONS.labels)
feedback = cache(FEEDBACK.labels)
surprise = cache(SURPRISE.labels)


def requests(method: str, route: str, status: int) -> Histogram:
    """Requests of a kind; there are few kinds, whatever clients send."""
    return _requests(method if method in METHODS else "other", route, status)


_requests = cache(REQUESTS.labels)
