"""What the service counts for Prometheus. Children are bound once: it halves the cost."""

from prometheus_client import Counter, Gauge, Histogram, Summary

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
