"""The form of every error (RFC 9457)."""

from typing import Annotated

from pydantic import BaseModel, Field


class FieldProblem(BaseModel):
    """One field at fault."""

    field: str = Field(examples=["params.horizon"])
    message: str
    value: Annotated[
        str | int | float | bool | None,
        Field(description="as it was sent, if it is short"),
    ] = None


class Problem(BaseModel):
    """What went wrong, for a program by `code`, for a person by `detail`."""

    type: str = Field(examples=["urn:encore:problem:feedback_conflict"])
    title: str
    status: int
    code: str = Field(examples=["feedback_conflict"])
    detail: str
    errors: list[FieldProblem] = []
