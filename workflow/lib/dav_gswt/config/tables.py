"""The tables of a config model: which model describes the keys at a place of the config."""

from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

ANY = "*"  # in a place: any name of an entry, or any position in a list


def iterate_tables(
    model: type[BaseModel], place: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], type[BaseModel]]]:
    """Every table below a model with its place, the model's own first.

    A place is a tuple of keys; `*` stands for a name or position that the user chooses, and a table that is one of
    several kinds is followed by its kind, as in ("scenes", "*", "synthetic").
    """
    yield place, model
    for name, field in model.model_fields.items():
        yield from _tables_of_type(field.annotation, (*place, name))


def _tables_of_type(annotation: Any, place: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], type[BaseModel]]]:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield from iterate_tables(annotation, place)
    elif origin is Annotated:
        yield from _tables_of_type(arguments[0], place)
    elif origin in (Union, UnionType):
        models = [a for a in arguments if isinstance(a, type) and issubclass(a, BaseModel)]
        kinds = [_kind_of(each) for each in models]
        for each, kind in zip(models, kinds, strict=True):
            yield from iterate_tables(each, (*place, kind) if kind and len(models) > 1 else place)
        for argument in arguments:
            if argument not in models:
                yield from _tables_of_type(argument, place)
    elif origin in (dict, list):
        yield from _tables_of_type(arguments[-1], (*place, ANY))


def _kind_of(model: type[BaseModel]) -> str:
    """The value of a model's `kind` or `model`, which tells it from the others of a union; empty where it has none."""
    for name in ("kind", "model"):
        field = model.model_fields.get(name)
        if field and get_origin(field.annotation) is Literal:
            return get_args(field.annotation)[0]
    return ""


def matching_table(model: type[BaseModel], location: tuple) -> type[BaseModel]:
    """The model of the table at the location of a validation error."""
    for place, table in iterate_tables(model):
        if len(place) == len(location) and all(p in (ANY, part) for p, part in zip(place, location, strict=True)):
            return table
    return model


def renamed_keys(model: type[BaseModel]) -> dict[str, str]:
    """The new name of each key that old config files call otherwise."""
    extras = {name: field.json_schema_extra for name, field in model.model_fields.items()}
    return {
        str(extra["renamed"]): name for name, extra in extras.items() if isinstance(extra, dict) and "renamed" in extra
    }
