"""What all config models share: closed, frozen tables, the types of their values, and which rules read each key.

The workflow reads this module before the first job, so it imports nothing heavy.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints
from pydantic.fields import FieldInfo

from dav_gswt.paths import NAME, RESERVED


class ConfigModel(BaseModel):
    """A table of the config: unknown keys are errors, values do not change, numbers are never made from text."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def _require_name(name: str) -> str:
    if not re.fullmatch(NAME, name):
        raise ValueError(
            f"{name!r} is no name: letters of ASCII, digits, - and _, from a letter, and none of {', '.join(RESERVED)}"
        )
    return name


Name = Annotated[str, AfterValidator(_require_name)]
Text = Annotated[str, StringConstraints(min_length=1)]
Seed = Annotated[int, Field(ge=0, le=2**32 - 1)]
Share = Annotated[float, Field(ge=0, le=1)]
Auto = Literal["auto"]

LARGEST_SIDE = 16_384  # pixels of a photo


# the longer side of photos, which are never enlarged; `native`: as they are
PhotoSize = Annotated[
    Annotated[int, Field(ge=32, le=LARGEST_SIDE)] | Literal["native"],
    AfterValidator(lambda size: LARGEST_SIDE if size == "native" else size),
]


def key(
    description: str,
    default: Any = ...,
    *,
    unit: str = "",
    read_by: Iterable[str] = (),
    agents: Iterable[str] = (),
    **bounds,
) -> Any:
    """Declare a key of a table.

    Args:
        read_by: The rules that get this key of a scene, preset, prior or `export`. A change of the key runs them
            again. A rule that is not named cannot read the key. A table may leave this to its own keys.
        agents: Rules that also read the scene's `agent` get this key for these agents only. Empty: for all.
    """
    extra = {"unit": unit, "read_by": list(read_by), "agents": list(agents)}
    return Field(
        default, description=description, json_schema_extra={name: v for name, v in extra.items() if v}, **bounds
    )


def _get_extra(field: FieldInfo, name: str) -> Any:
    """What `key` was given as `read_by` or `agents`."""
    extra = field.json_schema_extra
    return extra.get(name, []) if isinstance(extra, dict) else []


class EntryKeys(dict):
    """The keys of an entry of the config that a rule reads.

    To read one of the entry's other keys, `withheld`, is an error: the rule would take its default unnoticed.
    """

    def __init__(self, values: Mapping[str, Any], withheld: Iterable[str]):
        super().__init__(values)
        self.withheld = frozenset(withheld)

    def __missing__(self, key: str) -> Any:
        self._require_given(key)
        raise KeyError(key)

    def __contains__(self, key: object) -> bool:
        self._require_given(key)
        return super().__contains__(key)

    def get(self, key: str, default: Any = None) -> Any:
        self._require_given(key)
        return super().get(key, default)

    def _require_given(self, key: object) -> None:
        if key in self.withheld:
            raise LookupError(f"the rule is not given the key {key!r}: name the rule in the `read_by` of that key")


def select_keys(model: type[BaseModel], rule: str, entry: Mapping[str, Any]) -> EntryKeys:
    """The keys of an entry that a rule reads, as `read_by` of the model's keys says."""
    read = [name for name in model.model_fields if _is_read(model, rule, name, entry.get("agent", ""))]
    values = {name: entry[name] for name in read if name in entry}
    for name, value in values.items():
        field = model.model_fields[name]
        if (table := _find_table(field)) and rule not in _get_extra(field, "read_by"):
            values[name] = select_keys(table, rule, value)
    return EntryKeys(values, model.model_fields.keys() - read)


def _is_read(model: type[BaseModel], rule: str, name: str, agent: str = "") -> bool:
    """Whether a rule reads a key, or some key of the table that it is."""
    field, own = model.model_fields[name], model.model_fields.get("agent")
    agents = _get_extra(field, "agents")
    if agents and agent not in agents and own and rule in _get_extra(own, "read_by"):
        return False
    table = _find_table(field)
    inner = bool(table) and any(_is_read(table, rule, each) for each in table.model_fields)
    return inner or rule in _get_extra(field, "read_by")


def _find_table(field: FieldInfo) -> type[BaseModel] | None:
    """The model of a key that is one table; None for any other key."""
    kinds = [field.annotation, *get_args(field.annotation)]
    return next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)), None)


def lower_first(message: str) -> str:
    """A message of pydantic as part of a sentence."""
    return message[:1].lower() + message[1:]


ANY = "*"  # in a place: any name of an entry, or any position in a list
Place = tuple[str, ...]
Schema = dict[str, Any]


def iterate_tables(model: type[BaseModel]) -> Iterator[tuple[Place, Schema]]:
    """Every table below a model with its place and its JSON schema, the model's own first.

    A place is a tuple of keys. `*` stands for a name or position that the user chooses. A table that is one of several
    kinds is followed by its kind, as in ("scenes", "*", "synthetic").
    """
    schema = model.model_json_schema()
    yield from _iterate_value(schema, schema.get("$defs", {}), ())


def _iterate_value(value: Schema, defs: Schema, place: Place) -> Iterator[tuple[Place, Schema]]:
    value = _resolve(value, defs)
    if "properties" in value:
        yield place, value
    for name, inner in value.get("properties", {}).items():
        yield from _iterate_value(inner, defs, (*place, name))
    choices = value.get("anyOf", value.get("oneOf", []))
    several = sum("$ref" in choice for choice in choices) > 1
    for choice in choices:
        kind = [_resolve(choice, defs)["properties"]["kind"].get("const", ANY)] if several else []
        yield from _iterate_value(choice, defs, (*place, *kind))
    for inner in ("items", "additionalProperties"):
        if isinstance(value.get(inner), dict):
            yield from _iterate_value(value[inner], defs, (*place, ANY))


def _resolve(value: Schema, defs: Schema) -> Schema:
    return defs[value["$ref"].rpartition("/")[2]] if "$ref" in value else value
