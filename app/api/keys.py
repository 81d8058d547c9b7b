"""Keys: who may call."""

from datetime import timedelta
from functools import partial

from fastapi import APIRouter

from app.api.context import Administering
from app.api.problems import responses
from app.api.schemas.fields import PathId
from app.api.schemas.keys import KeyForm, KeyList, KeyMade, KeyView, RotateForm
from app.errors import KeyNotFound, LastAdminKey
from app.services import keys

router = APIRouter(prefix="/v1/admin/keys", tags=["keys"])


@router.get("")
async def list_keys(caller: Administering) -> KeyList:
    """List the keys in force."""
    in_force = await caller.database.run(keys.in_force)
    return KeyList(keys=[KeyView.of(key) for key in in_force])


@router.post("", status_code=201)
async def make_key(caller: Administering, form: KeyForm) -> KeyMade:
    """Make a key. Its secret is in this answer only."""
    make = partial(
        keys.create,
        scope=form.scope,
        name=form.name,
        by=caller.key.id,
        origins=form.origins,
    )
    key, secret = await caller.database.run(make)
    return KeyMade.with_secret(key, secret)


@router.post("/{id}/rotate", status_code=201, responses=responses(KeyNotFound))
async def rotate_key(
    caller: Administering,
    id: PathId,  # noqa: A002 - the name of the field that holds it
    form: RotateForm | None = None,
) -> KeyMade:
    """Make a key in place of one, which stays good for a while.

    The new one has the scope, name and origins of the old. Its secret is in this answer
    only. Without a body the old one is good for another hour.
    """
    grace = timedelta(seconds=(form or RotateForm()).grace_s)
    rotate = partial(keys.rotate, key_id=id, grace=grace, by=caller.key.id)
    key, secret = await caller.database.run(rotate)
    caller.context.keyring.forget()
    return KeyMade.with_secret(key, secret)


@router.delete("/{id}", status_code=204, responses=responses(KeyNotFound, LastAdminKey))
async def revoke_key(
    caller: Administering,
    id: PathId,  # noqa: A002 - the name of the field that holds it
) -> None:
    """Revoke a key: refused at once here, within a second by other workers."""
    revoke = partial(keys.revoke, key_id=id, by=caller.key.id)
    await caller.database.run(revoke)
    caller.context.keyring.forget()
    await caller.database.run(partial(keys.ensure_revoked, key_id=id))
