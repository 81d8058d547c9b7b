"""Forms of policies: one for each in the registry, derived from its declaration."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from operator import attrgetter
from typing import Annotated, Any, Self, TypeVar

from fastapi.openapi.models import Example
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetPydanticSchema,
    ValidationError,
    create_model,
)
from pydantic_core import (
    CoreSchema,
    InitErrorDetails,
    PydanticCustomError,
    SchemaValidator,
    core_schema,
)

from app.api.schemas.fields import Form, Note, whole
from app.api.schemas.pages import NextCursor
from app.domain import Described
from app.services.policy import Present
from app.services.policy_catalogue import Choice, Option, choices


class Params(Form):
    """Parameters of a policy."""

    model_config = ConfigDict(strict=True, allow_inf_nan=False)


class FollowedForm(Form):
    """A policy that another one follows; parameters left out take their defaults."""

    name: str
    params: Params = Params()


class PolicyForm(FollowedForm):
    """A policy to put in force; parameters left out take their defaults."""

    note: Note = ""

    def described(self) -> Described:
        """The policy, with the parameters that were given."""
        return Described(self.name, self.params.model_dump(exclude_unset=True))


class RollbackForm(Form):
    """Why the policy before the present one is put back."""

    note: Note = ""


class RungView(Form):
    """A policy by its name and all of its parameters."""

    name: str
    params: Mapping[str, object]


class PolicyInForce(Form):
    """A policy that is or was in force."""

    version: int
    name: str
    params: Annotated[
        Mapping[str, object], Field(description="complete, with all defaults")
    ]
    note: str
    activated_at: datetime
    by: Annotated[
        str,
        Field(
            description="id of the key that put it in force, else `encore` or `guard`"
        ),
    ]
    restores: Annotated[
        int | None, Field(description="the version that a rollback went back to")
    ]
    rungs: Annotated[
        list[RungView] | None,
        Field(
            description="what decides where it takes too long or fails, in this order;"
            " null: an earlier release did not say"
        ),
    ]


class TablesView(Form):
    """The index tables that the policy in force needs: one for each model."""

    ready: Annotated[int, Field(description="as fine as they get")]
    rough: Annotated[int, Field(description="in use until a full one is built")]
    of: int


class PresentPolicy(PolicyInForce):
    """The policy in force, and whether it has all that it needs."""

    tables: Annotated[
        TablesView | None, Field(description="null: the policy needs no index tables")
    ]
    warnings: Annotated[
        Sequence[str], Field(description="why it may not do what its name says")
    ]

    @classmethod
    def of(cls, present: Present) -> Self:
        version, tables = present.version, present.tables
        return cls.model_validate(
            {
                **dict(PolicyInForce.model_validate(version)),
                "tables": tables and TablesView.model_validate(tables),
                "warnings": present.warnings,
            }
        )


class PolicyChoice(Form):
    """A policy that may be put in force, and the form of its parameters."""

    name: str
    summary: str
    params: Annotated[
        Mapping[str, object], Field(description="a JSON schema, with all defaults")
    ]


class PolicyChoices(Form):
    policies: list[PolicyChoice]


class PolicyPage(Form):
    policies: list[PolicyInForce]
    next: NextCursor


class Named(BaseModel):
    """As much of a form as says which one it is."""

    model_config = ConfigDict(strict=True)

    name: str


def forms_of(choices: Iterable[Choice]) -> Mapping[str, type[PolicyForm]]:
    """The form of each policy, those that follow another last."""
    forms: dict[str, type[PolicyForm]] = {}
    followed: dict[str, type[FollowedForm]] = {}
    for choice in sorted(choices, key=attrgetter("follows_another")):
        params = _params_of(choice, followed)
        forms[choice.name] = _form(choice, params, PolicyForm)
        if not choice.follows_another:
            followed[choice.name] = _form(choice, params, FollowedForm)
    return forms


def chosen_by_name(
    forms: Mapping[str, type[FollowedForm]], *, optional: bool = False
) -> GetPydanticSchema:
    """The form that `name` asks for; faults are placed as if it were the only one."""

    def validate(value: object) -> FollowedForm | None:
        if value is None and optional:
            return None
        name = Named.model_validate(value).name
        if name in forms:
            return forms[name].model_validate(value)
        raise ValidationError.from_exception_data("policy", [_unknown(name, forms)])

    def schema(_source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        kinds = {name: handler.generate_schema(form) for name, form in forms.items()}
        union = core_schema.tagged_union_schema(kinds, "name")
        shown = core_schema.nullable_schema(union) if optional else union
        return core_schema.no_info_plain_validator_function(
            validate, json_schema_input_schema=shown
        )

    return GetPydanticSchema(schema)


AnyForm = TypeVar("AnyForm", bound=FollowedForm)


def _form(choice: Choice, params: type[Params], base: type[AnyForm]) -> type[AnyForm]:
    return create_model(
        _title(choice) + base.__name__.removesuffix("Form"),
        __base__=base,
        __doc__=choice.summary,
        name=Annotated[str, _one_of(choice.name)],
        params=(params, params()),
    )


def _params_of(
    choice: Choice, followed: Mapping[str, type[FollowedForm]]
) -> type[Params]:
    fields: dict[str, Any] = {o.name: _field(o, followed) for o in choice.options}
    if choice.presets:
        fields["preset"] = Annotated[
            str,
            _one_of(*choice.presets),
            Field(
                default=None,
                description="stands for all options that are left out",
                json_schema_extra=_without_default,
            ),
        ]
    return create_model(
        f"{_title(choice)}Params",
        __base__=Params,
        __doc__=f"Parameters of `{choice.name}`.",
        **fields,
    )


def _title(choice: Choice) -> str:
    return choice.name.title().replace("_", "")


def _field(option: Option, followed: Mapping[str, type[FollowedForm]]) -> object:
    parameter = option.parameter
    if parameter.is_policy:
        return Annotated[
            FollowedForm,
            chosen_by_name(followed),
            Field(default=option.default, description=parameter.description),
        ]
    if parameter.several:
        return Annotated[
            str | list[str],
            _some_of(*parameter.choices),
            Field(default=option.default, description=parameter.description),
        ]
    if parameter.choices:
        return Annotated[
            str,
            _one_of(*parameter.choices),
            Field(default=option.default, description=parameter.description),
        ]
    bounds = parameter.bounds
    field = Field(
        default=option.default,
        description=parameter.description,
        ge=None if bounds is None else bounds.low,
        le=None if bounds is None or bounds.below else bounds.high,
        lt=bounds.high if bounds is not None and bounds.below else None,
    )
    if parameter.kind is int:
        return Annotated[int, BeforeValidator(whole)], field
    return parameter.kind, field


def _one_of(*values: str) -> GetPydanticSchema:
    return GetPydanticSchema(lambda *_: core_schema.literal_schema([*values]))


def _some_of(*values: str) -> GetPydanticSchema:
    """One of these, or a list of several, in which only the first of equals counts."""
    one = core_schema.literal_schema([*values])
    several = core_schema.list_schema(one, min_length=1, max_length=len(values))
    single, multiple = SchemaValidator(one), SchemaValidator(several)

    def validate(value: object) -> object:
        chosen = multiple if isinstance(value, list) else single
        checked: object = chosen.validate_python(value, strict=True)
        return list(dict.fromkeys(checked)) if isinstance(checked, list) else checked

    return GetPydanticSchema(
        lambda *_: core_schema.no_info_plain_validator_function(
            validate, json_schema_input_schema=core_schema.union_schema([one, several])
        )
    )


def _without_default(schema: dict[str, Any]) -> None:
    del schema["default"]


def _unknown(name: str, forms: Iterable[str]) -> InitErrorDetails:
    message = f"must be one of {', '.join(forms)}"
    error = PydanticCustomError("unknown_policy", "{message}", {"message": message})
    return {"type": error, "loc": ("name",), "input": name}


FORMS = forms_of(choices())
EXAMPLES: dict[str, Example] = {
    name: {
        "summary": name,
        "value": form(name=name, note="why").model_dump(exclude_none=True),
    }
    for name, form in FORMS.items()
}

AnyPolicyForm = Annotated[PolicyForm, chosen_by_name(FORMS)]
OptionalPolicyForm = Annotated[PolicyForm | None, chosen_by_name(FORMS, optional=True)]
CHOICES = PolicyChoices(
    policies=[
        PolicyChoice(
            name=choice.name,
            summary=choice.summary,
            params=type(
                FORMS[choice.name].model_fields["params"].default
            ).model_json_schema(),
        )
        for choice in choices()
    ]
)
