"""The key reference and the JSON schema, made from config models. `make reference` writes them with the study's."""

import json
import types
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from dav_gswt.config.model import Config
from dav_gswt.config.tables import iterate_tables
from dav_gswt.views.policies import POLICIES

HEAD = """# Config reference

Made from the models in `workflow/lib/dav_gswt/config/` by `make reference`. The config is closed: a misspelt,
renamed or out-of-range key stops before the first job with one message. `config/config.yaml` is the experiment,
`config/scenes/<name>.yaml` one scene each, `config/study.yaml` what the study compares. Lay single keys over them
on the command line (`snakemake --cores 2 --config rounds=3`), or a file (`--configfile mine.yaml`). A key whose default
is *required* must be given; one without any may be left out.
"""
POLICIES_HEAD = """# Policies

How the next views are chosen: the config's `policy`. `auto`, the default, takes `farthest` where a scene chooses from
given photos (`agent: replay`), else `coverage-error`; [what each is worth](../active-views.md). Made
by `make reference` from the decorators in `workflow/lib/dav_gswt/views/policies.py`;
[architecture](../architecture.md#a-policy) says how to add one.

Every policy knows where the candidates and the photos so far are; the column `reads` says what it reads besides:
the scores by a prior, the field itself, the photos so far, or what candidates truly show, which is known for
`agent: render` and `replay` only. `prior`, `p_drop` and `lam` matter to policies that read a prior; settings
after "not" have no effect. k is the config's `k`.
"""


def describe_tables(model: type[BaseModel], place: tuple[str, ...] = ()) -> str:
    """Every table of a model, with its keys. place: where the model lies in the config."""
    return "\n\n".join(_describe_table((*place, *where), table) for where, table in iterate_tables(model))


def describe_policies() -> str:
    """The page docs/reference/policies.md."""
    rows = [f"| `{spec.name}` | {spec.chooses} | {spec.describe_inputs()} |" for spec in POLICIES.values()]
    return "\n".join([POLICIES_HEAD, "| policy | chooses | reads |", "|---|---|---|", *rows]) + "\n"


def make_schema() -> str:
    """The JSON schema of the product's config, for editors."""
    return json.dumps(Config.model_json_schema(), indent=1) + "\n"


def _describe_table(place: tuple[str, ...], table: type[BaseModel]) -> str:
    name = ".".join("<name>" if part == "*" else part for part in place) or "Top level"
    rows = [_describe_key(field.alias or key, field) for key, field in table.model_fields.items()]
    head = ["| key | meaning | values | default |", "|---|---|---|---|"]
    return "\n".join([f"### {name}", "", (table.__doc__ or "").strip(), "", *head, *rows])


def _describe_key(key: str, field: FieldInfo) -> str:
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    values = _describe_type(field.annotation, [*field.metadata])
    unit = f", {extra['unit']}" if "unit" in extra else ""
    default = "" if field.default in (PydanticUndefined, None) else f"`{_plain(field.default)}`"
    default = "*required*" if field.is_required() else default
    return f"| `{key}` | {field.description or ''} | {values}{unit} | {default} |"


def _describe_type(annotation: Any, bounds: list) -> str:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        inner = [m for argument in arguments[1:] for m in getattr(argument, "metadata", [argument])]
        return _describe_type(arguments[0], [*inner, *bounds])
    if origin is Literal:
        return ", ".join(f"`{value}`" for value in arguments)
    if origin in (Union, types.UnionType):
        kinds = [_describe_type(argument, bounds) for argument in arguments if argument is not type(None)]
        return " or ".join(dict.fromkeys(kind for kind in kinds if kind))
    if origin is list:
        return f"list of {_describe_type(arguments[0], [])}"
    if origin is tuple:
        return f"{len(arguments)} numbers"
    if origin is dict:
        return "table by name"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "table"
    name = {int: "whole number", float: "number", str: "text", bool: "`true`, `false`"}.get(annotation, "")
    return name + _describe_bounds(bounds)


def _describe_bounds(bounds: list) -> str:
    found = {
        key: getattr(m, key) for m in bounds for key in ("ge", "gt", "le", "lt") if getattr(m, key, None) is not None
    }
    words = {"ge": "from", "gt": "above", "le": "to", "lt": "below"}
    return "".join(f" {words[key]} {found[key]:g}" for key in words if key in found)


def _plain(value: Any) -> str:
    if isinstance(value, BaseModel):
        value = value.model_dump(exclude_none=True)
    if isinstance(value, list):
        return f"[{', '.join(map(_plain, value))}]"
    return json.dumps(value)
