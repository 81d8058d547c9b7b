"""Import of a whole catalogue of items."""

from tempfile import SpooledTemporaryFile
from typing import Annotated, Any

import structlog
from fastapi import APIRouter, Query, Request
from starlette.requests import ClientDisconnect

from app.api.context import Administering
from app.api.problems import responses
from app.api.schemas.lines import ITEMS, ImportResult
from app.errors import InvalidImport, MalformedBody, UnsupportedMediaType
from app.services import imports
from app.services.formats import Format
from app.services.lines import LineFile

FORMATS = {"application/x-ndjson": Format.NDJSON, "text/csv": Format.CSV}
IN_MEMORY = 1_000_000
EXAMPLES = {
    Format.NDJSON: '{"id": "song-7", "model": "pop", "title": "Night Drive"}\n',
    Format.CSV: "id,model,title,tags,payload\nsong-7,pop,Night Drive,calm;late,{}\n",
}
BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            media_type: {"schema": {"type": "string"}, "example": EXAMPLES[format_]}
            for media_type, format_ in FORMATS.items()
        },
    }
}

router = APIRouter(prefix="/v1", tags=["items"])
logger = structlog.get_logger()

DryRun = Annotated[bool, Query(description="change nothing, tell what would change")]
RetireMissing = Annotated[
    bool, Query(description="retire the items that the file does not name")
]


@router.post(
    "/items/import",
    openapi_extra=BODY,
    responses=responses(InvalidImport, UnsupportedMediaType, MalformedBody),
)
async def import_items(
    caller: Administering,
    request: Request,
    dry_run: DryRun = False,
    retire_missing: RetireMissing = False,
) -> ImportResult:
    """Create and replace the items of a file, an item a line: all of them, or none.

    NDJSON: the fields of `PUT /v1/items/{item}`, and `id`. CSV: the same as columns,
    named by the first line; tags separated by `;`, the payload as JSON. An item that
    the file calls not `active` is retired; any other is active.
    """
    format_ = _format(request.headers.get("content-type", ""))
    with SpooledTemporaryFile(IN_MEMORY) as body:
        try:
            async for chunk in request.stream():
                body.write(chunk)
        except ClientDisconnect as error:
            raise MalformedBody("The body ended before all of it was sent.") from error
        imported = await imports.import_items(
            caller.database,
            caller.live,
            LineFile(body, format_, ITEMS),
            by=caller.key.id,
            dry_run=dry_run,
            retire_missing=retire_missing,
        )
    result = ImportResult.model_validate(imported)
    logger.info("import", **result.model_dump())
    return result


def _format(content_type: str) -> Format:
    media_type, _, parameters = content_type.lower().partition(";")
    charset = parameters.partition("charset=")[2].strip(' "')
    found = FORMATS.get(media_type.strip())
    if found is None or charset not in {"", "utf-8", "utf8"}:
        expected = " or ".join(FORMATS)
        raise UnsupportedMediaType(f"Send {expected}, in UTF-8.")
    return found
