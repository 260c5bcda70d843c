"""Pages and schemas that are made from the config models.

`make reference` writes the page of policies and the JSON schemas; `make docs` makes the page of the config's keys.
"""

import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from dav_gswt.bundle import manifest
from dav_gswt.config.base import ANY, Place, Schema, iterate_tables
from dav_gswt.config.model import Config
from dav_gswt.views.policies import POLICIES

HEAD = """# Config reference

Made from the models in `workflow/lib/dav_gswt/config/` with the site. The config is closed: a misspelt or
out-of-range key stops the program before the first job with one message. `config/config.yaml` is the experiment, and
each `config/scenes/<name>.yaml` is one scene. Lay single keys over them on the command line (`snakemake --cores 2
--config rounds=3`), or a file (`--configfile mine.yaml`). A key whose default is *required* must be given. A key
without a default may be left out."""
POLICIES_HEAD = """# Policies

A policy chooses the poses from which the k photos of the next [round](../glossary.md) are taken.
The default, `policy: auto`, is `farthest` if a scene chooses from existing photos (`agent:
replay`), otherwise `coverage-error` ([why](../active-views.md)).

The column "reads" lists what a policy uses:

- `poses`: the camera poses of the candidates and of the photos so far. Every policy uses them.
- `field`: the Gaussians that were fitted to the photos so far
- `photos`: the photos so far
- `prior`: samples of a [diffusion prior](../prior.md), a network that paints guesses of what a
  candidate would show. A policy without `prior` in the column ignores the config's keys `prior`,
  `p_drop` and `lam`. A policy with "prior (not `lam`)" ignores `lam`.

A *cell* is a square of the ground. The longer side of the ground has 28 cells.
[Terms](../prior.md#terms) defines `w2_sq` (W2, the 2-Wasserstein distance, squared), `lpips` and
`gradient`. In a sum, each term is divided by the median of its non-zero values in the first round.

[Architecture](../architecture.md#a-policy) shows how to add a policy.
"""


def describe_tables(model: type[BaseModel], place: Place = ()) -> str:
    """Every table of a model once, with its places and its keys. place: where the model lies in the config."""
    found: dict[int, tuple[list[Place], Schema]] = {}
    for where, table in iterate_tables(model):
        found.setdefault(id(table), ([], table))[0].append((*place, *where))
    return "\n\n".join(_describe_table(places, table) for places, table in found.values())


def describe_config() -> str:
    """The page reference/config.md of the site."""
    return f"{HEAD}\n\n{describe_tables(Config)}\n"


def describe_policies() -> str:
    """The page docs/reference/policies.md."""
    rows = [f"| `{spec.name}` | {spec.chooses} | {spec.describe_inputs()} |" for spec in POLICIES.values()]
    return "\n".join([POLICIES_HEAD, "| policy | chooses | reads |", "|---|---|---|", *rows]) + "\n"


def make_schema() -> str:
    """The JSON schema of the config, for editors."""
    text = json.dumps(Config.model_json_schema())
    ours = ("read_by", "agents")  # of `config.base.key`, of no use to an editor
    schema = json.loads(text, object_hook=lambda table: {key: v for key, v in table.items() if key not in ours})
    return json.dumps(schema, indent=1) + "\n"


def make_reference() -> dict[str, str]:
    """The text of each file that is made from the config models, by its path in the repository."""
    return {
        "docs/reference/policies.md": describe_policies(),
        "workflow/schemas/config.schema.json": make_schema(),
        "workflow/schemas/davgswt.schema.json": manifest.make_schema(),
    }


def write_files(texts: dict[str, str]) -> None:
    """Write texts to their paths below the working directory."""
    for name, text in texts.items():
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text(text, encoding="utf-8")


def _describe_table(places: list[Place], table: Schema) -> str:
    names = [".".join("<name>" if part == ANY else part for part in place) or "Top level" for place in places]
    rows = [_describe_key(key, value, key in table.get("required", ())) for key, value in table["properties"].items()]
    head = ["| key | meaning | values | default |", "|---|---|---|---|"]
    return "\n".join([f"### {', '.join(names)}", "", table.get("description", ""), "", *head, *rows])


def _describe_key(key: str, value: Schema, required: bool) -> str:
    unit = f", {value['unit']}" if "unit" in value else ""
    default = "" if value.get("default") is None else f"`{_format_value(value['default'])}`"
    meaning, default = value.get("description", ""), "*required*" if required else default
    return f"| `{key}` | {meaning} | {_describe_values(value)}{unit} | {default} |"


def _describe_values(value: Schema) -> str:
    if named := value.get("enum", [value["const"]] if "const" in value else []):
        return ", ".join(f"`{name}`" for name in named)
    if choices := value.get("anyOf", value.get("oneOf")):
        kinds = [_describe_values(choice) for choice in choices if choice.get("type") != "null"]
        return " or ".join(dict.fromkeys(kinds))
    kind = value.get("type", "object")
    if kind == "array" and "prefixItems" in value:
        return f"{len(value['prefixItems'])} numbers"
    if kind == "array":
        return f"list of {_describe_values(value['items'])}"
    if kind == "object":
        return "table by name" if "additionalProperties" in value else "table"
    words = {"minimum": "from", "exclusiveMinimum": "above", "maximum": "to", "exclusiveMaximum": "below"}
    bounds = [f"{word} {value[bound]:g}" for bound, word in words.items() if bound in value]
    names = {"integer": "whole number", "number": "number", "string": "text", "boolean": "`true`, `false`"}
    return " ".join([names[kind], *bounds])


def _format_value(value: Any) -> str:
    """A default as YAML and JSON have it, without the keys that have no value."""
    if isinstance(value, dict):
        value = {key: each for key, each in value.items() if each is not None}
    return json.dumps(value)


if __name__ == "__main__":
    write_files(make_reference())
