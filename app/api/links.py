"""Which call's answer leads to which other call, for the API document."""

from collections.abc import Mapping

PLAY = {"play": "$response.body#/play"}
USER = {"user": "$request.path.user"}
ITEM = {"item": "$request.path.item"}
MODEL = {"model": "$request.path.model"}

# operation -> operations that follow it -> where their parameters come from
LINKS: Mapping[str, Mapping[str, Mapping[str, str]]] = {
    "next_play": {"give_feedback": PLAY, "read_play": PLAY},
    "next_play_of": {"give_feedback": PLAY, "read_play": PLAY},
    "give_feedback": {"read_play": PLAY},
    "report_play": {
        "read_play": PLAY,
        "list_plays": USER,
        "export_user": USER,
        "erase_user": USER,
    },
    "put_item": {"get_item": ITEM, "retire_item": ITEM},
    "put_model": {"get_model": MODEL, "delete_model": MODEL},
    "make_key": {"revoke_key": {"id": "$response.body#/id"}},
}


def links_of(operation: str) -> dict[str, object]:
    """The links of an operation, in OpenAPI's form."""
    return {
        following: {"operationId": following, "parameters": dict(parameters)}
        for following, parameters in LINKS.get(operation, {}).items()
    }
