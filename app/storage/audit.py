"""The log of administrative acts: who did what, when."""

from collections.abc import Mapping
from datetime import datetime

from uuid_utils.compat import uuid7

from app.storage.store import Store
from app.storage.tables import audit

INSERT = audit.insert()


def note(
    store: Store,
    at: datetime,
    by: str,
    action: str,
    subject: str,
    detail: Mapping[str, object] | None = None,
) -> None:
    store.write(
        INSERT,
        {
            "id": uuid7(),
            "at": at,
            "by": by,
            "action": action,
            "subject": subject,
            "detail": detail or {},
        },
    )
