"""What the service counts for Prometheus.

Where several processes serve together, each counts in files that all of them read.
"""

from functools import cache

from prometheus_client import (
    Counter,
    Gauge,
    Histogram,
    Summary,
    disable_created_metrics,
    values,
)

from app import workers

disable_created_metrics()  # type: ignore[no-untyped-call]

SHARED = workers.directory()
if SHARED is not None:
    NUMBER = workers.take(SHARED)
    values.ValueClass = values.MultiProcessValue(lambda: NUMBER)  # type: ignore[no-untyped-call]

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
DEGRADED = Counter(
    "encore_decisions_degraded",
    "Plays not chosen by the policy itself, but by a rung below it, and why",
    ["policy", "rung", "cause"],
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

ERRORS = Counter("encore_errors", "Requests refused or failed, by code", ["code"])
RETRIES = Counter(
    "encore_retries",
    "Units of work run again: what they relied on has moved, or the database said so",
    ["reason"],
)
COMMITS = Histogram(
    "encore_commit_seconds",
    "Time to write and commit a batch of units of work",
    buckets=(0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1, 5),
)
COMMIT_UNITS = Histogram(
    "encore_commit_units",
    "Units of work that were committed together",
    buckets=(1, 2, 4, 8, 16, 32, 64, 128, 256),
)
QUEUED = Gauge(
    "encore_queued_units",
    "Units of work that wait to be written",
    multiprocess_mode="livesum",
)
QUEUE_LIMIT = Gauge(
    "encore_queue_limit", "How many may wait before 503", multiprocess_mode="livesum"
)
CONNECTIONS = Gauge(
    "encore_connections_in_use",
    "Connections to PostgreSQL that are in use",
    ["pool"],
    multiprocess_mode="livesum",
)
CONNECTION_LIMIT = Gauge(
    "encore_connection_limit",
    "How many there may be",
    ["pool"],
    multiprocess_mode="livesum",
)

BUILD = Gauge(
    "encore_build_info", "What serves", ["version"], multiprocess_mode="livemax"
)
WORKERS = Gauge("encore_workers", "Processes that serve", multiprocess_mode="livesum")
READY = Gauge(
    "encore_workers_ready",
    "Of these, processes whose decision code is compiled",
    multiprocess_mode="livesum",
)
STARTED = Gauge(
    "encore_start_time_seconds",
    "When the latest of them was started",
    multiprocess_mode="livemax",
)
MEMORY = Gauge(
    "encore_memory_bytes", "Resident memory of all of them", multiprocess_mode="livesum"
)
OPEN_FILES = Gauge(
    "encore_open_files_share",
    "Share of the files it may open, of the one that has most open",
    multiprocess_mode="livemax",
)
CPU = Counter("encore_cpu_seconds", "Processor time of all of them")
LAG = Histogram(
    "encore_loop_lag_seconds",
    "How late an event loop is: what waits for nothing else waits so long",
    buckets=(0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5),
)

SHADOW_DECISIONS = Counter(
    "encore_shadow_decisions",
    "Decisions of a policy that is not served, and whether it chose what was",
    ["shadow", "agreed"],
)
SHADOW_LIKES = Counter(
    "encore_shadow_expected_likes",
    "Rewards expected of what a shadow chose, and of what was served instead",
    ["shadow", "of"],
)
SHADOW_MISSES = Counter(
    "encore_shadow_misses",
    "Decisions that a shadow did not take: skipped or failed",
    ["shadow", "cause"],
)

METHODS = {"DELETE", "GET", "HEAD", "OPTIONS", "PATCH", "POST", "PUT"}

# Labels are looked up once, then kept: that halves the cost of an observation.
decisions = cache(DECISIONS.labels)
degraded = cache(DEGRADED.labels)
feedback = cache(FEEDBACK.labels)
shadow_decisions = cache(SHADOW_DECISIONS.labels)
shadow_likes = cache(SHADOW_LIKES.labels)
shadow_misses = cache(SHADOW_MISSES.labels)
surprise = cache(SURPRISE.labels)
errors = cache(ERRORS.labels)
retries = cache(RETRIES.labels)
errors("internal_error")  # is 0 first: of a count that begins at 1, no rise is seen


def requests(method: str, route: str, status: int) -> Histogram:
    """Requests of a kind; there are few kinds, whatever clients send."""
    return _requests(method if method in METHODS else "other", route, status)


_requests = cache(REQUESTS.labels)
