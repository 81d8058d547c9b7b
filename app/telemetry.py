"""Traces by OpenTelemetry, sent to a collector by OTLP over HTTP.

Spans are made by hand: to instrument the web framework costs twice what a request does,
also where only one in a hundred is traced. What is not set here is set by the standard
variables OTEL_*, which the packages read themselves.
"""

import random
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

from opentelemetry import trace
from opentelemetry.context import Context
from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.resources import SERVICE_NAME, Resource
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor
from opentelemetry.sdk.trace.sampling import ALWAYS_ON
from opentelemetry.trace import (
    NonRecordingSpan,
    Span,
    SpanContext,
    SpanKind,
    Status,
    StatusCode,
    TraceFlags,
)

from app import __version__
from app.settings import Telemetry
from app.tracing import Parent, current

FAULT = 500


@dataclass(frozen=True, slots=True)
class Moment:
    """A moment by both clocks, to tell the one by the other."""

    wall: int = field(default_factory=time.time_ns)
    steady: float = field(default_factory=time.perf_counter)

    def wall_at(self, steady: float) -> int:
        return self.wall + round((steady - self.steady) * 1e9)

    def wall_now(self) -> int:
        return self.wall_at(time.perf_counter())


@dataclass(frozen=True, slots=True)
class Spans:
    """The spans of one request, below the one that is open."""

    tracer: trace.Tracer
    span: Span
    moment: Moment

    def note(
        self, name: str, began: float, ended: float, attributes: Mapping[str, str]
    ) -> None:
        self._begun(name, self.moment.wall_at(began), attributes).end(
            self.moment.wall_at(ended)
        )

    @contextmanager
    def within(self, name: str) -> Iterator[None]:
        span = self._begun(name, self.moment.wall_now(), {})
        before = current.set(Spans(self.tracer, span, self.moment))
        try:
            yield
        except Exception as error:
            span.set_attribute("error.type", type(error).__name__)
            raise
        finally:
            current.reset(before)
            span.end(self.moment.wall_now())

    def _begun(self, name: str, at: int, attributes: Mapping[str, str]) -> Span:
        within = trace.set_span_in_context(self.span)
        return self.tracer.start_span(
            name, within, attributes=attributes, start_time=at
        )


@dataclass(frozen=True, slots=True)
class TracedRequest:
    """The span of a request, below which are all others."""

    span: Span
    moment: Moment

    @property
    def trace(self) -> str:
        return trace.format_trace_id(self.span.get_span_context().trace_id)

    def end(self, name: str, status: int, attributes: Mapping[str, str | int]) -> None:
        self.span.update_name(name)
        self.span.set_attributes(attributes)
        if status >= FAULT:
            self.span.set_status(Status(StatusCode.ERROR))
        current.set(None)
        self.span.end(self.moment.wall_now())


class OpenTelemetry:
    """Traces a share of the requests.

    trusting: whether a caller's traceparent decides instead
    """

    def __init__(self, telemetry: Telemetry, *, trusting: bool) -> None:
        self._share = telemetry.share
        self._trusting = trusting
        self._provider = TracerProvider(
            sampler=ALWAYS_ON, resource=_resource(), shutdown_on_exit=False
        )
        self._provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
        self._tracer = self._provider.get_tracer("encore", __version__)

    def samples(self, parent: Parent | None) -> bool:
        """Decide by our own dice: callers choose the ids of their traces."""
        if self._trusting and parent is not None:
            return parent.sampled
        return random.random() < self._share  # noqa: S311 - not for secrets

    def begin(self, parent: Parent | None) -> TracedRequest:
        within = None if parent is None else _context(parent)
        moment = Moment()
        span = self._tracer.start_span(
            "request", within, kind=SpanKind.SERVER, start_time=moment.wall
        )
        current.set(Spans(self._tracer, span, moment))
        return TracedRequest(span, moment)

    def close(self) -> None:
        self._provider.shutdown()


def _context(parent: Parent) -> Context:
    flags = TraceFlags(TraceFlags.SAMPLED if parent.sampled else TraceFlags.DEFAULT)
    remote = SpanContext(parent.trace, parent.span, is_remote=True, trace_flags=flags)
    return trace.set_span_in_context(NonRecordingSpan(remote))


def _resource() -> Resource:
    """Who sends; the environment may name it otherwise."""
    found = Resource.create({"service.version": __version__})
    named = str(found.attributes[SERVICE_NAME])
    if named.startswith("unknown_service"):
        return found.merge(Resource({SERVICE_NAME: "encore"}))
    return found
