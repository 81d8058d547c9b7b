"""What can go wrong that a caller should know: each with a stable code and status.

The api renders them as problem+json (RFC 9457); docs/errors.md lists them.
"""

from dataclasses import dataclass
from http import HTTPStatus
from typing import ClassVar


@dataclass(frozen=True, slots=True)
class Fault:
    """One field at fault."""

    field: str
    message: str
    value: object = None


class ClientError(Exception):
    """An error that is answered, not logged: the caller can do something about it."""

    status: ClassVar[HTTPStatus]
    code: ClassVar[str]
    title: ClassVar[str]
    retry_after: int | None = None  # seconds

    def __init__(self, detail: str, *faults: Fault) -> None:
        super().__init__(detail)
        self.detail = detail
        self.faults = faults


class NotFound(ClientError):
    status = HTTPStatus.NOT_FOUND


class Conflict(ClientError):
    status = HTTPStatus.CONFLICT


class Invalid(ClientError):
    status = HTTPStatus.UNPROCESSABLE_ENTITY


class Unavailable(ClientError):
    status = HTTPStatus.SERVICE_UNAVAILABLE
    retry_after = 1


class InvalidRequest(Invalid):
    code = "invalid_request"
    title = "The request does not have the form asked for"


class MalformedBody(Invalid):
    code = "malformed_body"
    title = "The request body cannot be read"


class UnknownItems(Invalid):
    code = "unknown_item"
    title = "The request names items that are not in the catalogue"


class UnknownModel(Invalid):
    code = "unknown_model"
    title = "The request names a model that does not exist"


class UnknownSignal(Invalid):
    code = "unknown_signal"
    title = "The model of the item has no such signal"


class UnusableModel(Invalid):
    code = "invalid_model"
    title = "The matrices and chances make no model"


class UnusableExperiment(Invalid):
    code = "invalid_experiment"
    title = "Arms and shares make no experiment"


class TooLargeToBound(Invalid):
    code = "too_large_to_bound"
    title = "A bound of this catalogue would take too long"


class TooLongToSimulate(Invalid):
    code = "too_long_to_simulate"
    title = "This simulation would take too long"


class InvalidCursor(Invalid):
    code = "invalid_cursor"
    title = "The cursor is not one that a page gave"

    def __init__(self, cursor: str) -> None:
        detail = "Pass `next` of the page before, unchanged."
        super().__init__(detail, Fault("cursor", "not a cursor of this list", cursor))


class InvalidImport(Invalid):
    code = "invalid_import"
    title = "The import has lines in error; nothing was changed"


class ItemNotFound(NotFound):
    code = "item_not_found"
    title = "No such item"

    def __init__(self, item: str) -> None:
        super().__init__(f"There is no item {item!r}.", Fault("item", "unknown", item))


class ModelNotFound(NotFound):
    code = "model_not_found"
    title = "No such model"

    def __init__(self, model: str, version: int | None = None) -> None:
        of = "" if version is None else f"version {version} of "
        fault = Fault("model" if version is None else "version", "unknown", model)
        super().__init__(f"There is no {of}model {model!r}.", fault)


class PlayNotFound(NotFound):
    code = "play_not_found"
    title = "No such play"

    def __init__(self, play: object) -> None:
        super().__init__(f"There is no play {play}.", Fault("play", "unknown", play))


class KeyNotFound(NotFound):
    code = "key_not_found"
    title = "No such key"

    def __init__(self, key: str) -> None:
        super().__init__(f"There is no key {key!r}.", Fault("id", "unknown", key))


class ExperimentNotFound(NotFound):
    code = "experiment_not_found"
    title = "No such experiment"


class UserNotFound(NotFound):
    code = "user_not_found"
    title = "Nothing is held about this user"

    def __init__(self, user: str) -> None:
        fault = Fault("user", "unknown", user)
        super().__init__(f"Nothing is held about user {user!r}.", fault)


class NothingToPlay(Conflict):
    code = "nothing_to_play"
    title = "No item is left to choose from"


class FeedbackConflict(Conflict):
    code = "feedback_conflict"
    title = "This play already has a different answer"


class IdempotencyConflict(Conflict):
    code = "idempotency_conflict"
    title = "This idempotency key was used for a different report"


class MoodsDiffer(Conflict):
    code = "moods_differ"
    title = "All models of a catalogue have one mood"


class ModelInUse(Conflict):
    code = "model_in_use"
    title = "Items still use this model"


class TooManyStates(Conflict):
    code = "too_many_states"
    title = "A model has too many states for a policy that needs index tables"


class SamplesApart(Conflict):
    code = "samples_apart"
    title = "A policy needs one index table for all samples of a model"


class LastAdminKey(Conflict):
    code = "last_admin_key"
    title = "The last admin key cannot be revoked"


class NoEarlierPolicy(Conflict):
    code = "no_earlier_policy"
    title = "There is no earlier policy to return to"


class ExperimentRuns(Conflict):
    code = "experiment_runs"
    title = "Another experiment runs"

    def __init__(self, name: str) -> None:
        fault = Fault("name", f"is {name!r} for as long as that runs")
        super().__init__(f"End the experiment {name!r} first.", fault)


class ExperimentFixed(Conflict):
    code = "experiment_fixed"
    title = "What an experiment compares is fixed while it runs"

    def __init__(self, name: str, *faults: Fault) -> None:
        super().__init__(f"That would make {name!r} another experiment.", *faults)


class NoPublication(Conflict):
    code = "no_publication"
    title = "There is no publication to take back"


class Unauthorized(ClientError):
    status = HTTPStatus.UNAUTHORIZED
    code = "unauthorized"
    title = "A valid key is needed"


class Forbidden(ClientError):
    status = HTTPStatus.FORBIDDEN
    code = "forbidden"
    title = "The key does not allow this"


class UnknownOrigin(ClientError):
    status = HTTPStatus.FORBIDDEN
    code = "unknown_origin"
    title = "The key is not for pages of this origin"


class TooManyRequests(ClientError):
    """`after`: seconds until another one may come."""

    status = HTTPStatus.TOO_MANY_REQUESTS
    code = "too_many_requests"
    title = "Too many requests; try again later"

    def __init__(self, detail: str, *faults: Fault, after: int) -> None:
        super().__init__(detail, *faults)
        self.retry_after = after


class BodyTooLarge(ClientError):
    status = HTTPStatus.REQUEST_ENTITY_TOO_LARGE
    code = "body_too_large"
    title = "The request body is too large"


class UnsupportedMediaType(ClientError):
    status = HTTPStatus.UNSUPPORTED_MEDIA_TYPE
    code = "unsupported_media_type"
    title = "The request body is of a kind that is not taken here"


class Overloaded(Unavailable):
    code = "overloaded"
    title = "Too much is waiting to be written; try again shortly"


class DatabaseUnavailable(Unavailable):
    code = "database_unavailable"
    title = "The database does not answer; try again shortly"


class Contended(Unavailable):
    code = "contended"
    title = "Too many changes to one thing at once; try again shortly"


class SimulatorBusy(Unavailable):
    code = "simulator_busy"
    title = "Another simulation goes on; try again shortly"


class NotReady(Unavailable):
    code = "not_ready"
    title = "The service is not ready to answer"
