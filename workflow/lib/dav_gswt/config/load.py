"""Read config files, check them, and fill in the defaults; errors name the key and what it may be."""

import logging
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from dav_gswt.config.base import ANY, iterate_tables, lower_first
from dav_gswt.config.model import Config
from dav_gswt.errors import InputError, summarize_error

_log = logging.getLogger(__name__)

Model = TypeVar("Model", bound=BaseModel)

ALIASES = {"views_per_round": "k"}  # Snakemake's --config takes no key of one letter
REFERENCE = "workflow/schemas/config.schema.json lists every key"


def read_config(files: list[Path], changes: Mapping | None = None) -> dict:
    """A config as Snakemake reads it: each file's keys replace those of the files before; `changes` come last.

    Raises: InputError: a file is missing or not YAML (with the line), or holds no keys.
    """
    config: dict = {}
    for file in files:
        config = merge_tables(config, _read_yaml(Path(file)))
    return merge_tables(config, dict(changes or {}))


def merge_tables(below: dict, above: dict) -> dict:
    """`below` with the keys of `above`; where both have a table, key by key."""
    both = {
        key: merge_tables(below[key], value) if isinstance(value, dict) and isinstance(below.get(key), dict) else value
        for key, value in above.items()
    }
    return below | both


def add_scene_files(config: dict, folder: Path, quietly: bool = False) -> dict:
    """The config with the scenes of config/scenes/*.yaml (or .yml); keys of `scenes` replace those of a file.

    A file that is no scene is left out, with a warning unless `quietly`, if the config neither asks for its scene nor
    has keys of it.
    Raises: InputError: the requested file is not YAML, two files share a name, or the config already has a scene of
    that name and of another kind.
    """
    scenes, own = {}, config.get("scenes") or {}
    for path in sorted(folder.glob("[!.]*.y*ml")):  # those with a dot are of an editor or a file system
        if path.stem in scenes:
            raise InputError(f"{path}: there is a scene of this name in {path.stem}.yaml, too; remove one of them")
        try:
            scenes[path.stem] = scene = _read_yaml(path)
            if path.stem not in (config.get("scene"), *own):
                _require_scene(path.stem, scene, config)
        except InputError as error:
            if path.stem in (config.get("scene"), *own):
                raise
            scenes.pop(path.stem, None)
            if not quietly:
                _log.warning("%s: the scene is left out: %s", path, str(error).removeprefix(f"{path}: "))
            continue
        kinds = [table.get("kind") for table in (scene, own.get(path.stem) or {}) if isinstance(table, dict)]
        if len(kinds) == 2 and all(kinds) and kinds[0] != kinds[1]:
            raise InputError(f"{path}: the config has a scene {path.stem} of kind {kinds[1]}, too; rename this file")
    return config | {"scenes": merge_tables(scenes, own)}


def _require_scene(name: str, scene: dict, config: dict) -> None:
    """Raises: InputError: the scene could not be made by this config, for a reason that lies in the scene."""
    try:
        check_config(config | {"scene": name, "scenes": {name: scene}})
    except InputError as error:
        if str(error).startswith(f"config: scenes.{name}"):
            raise


def parse_command_line(values: Mapping[str, Any]) -> dict[str, Any]:
    """The keys of Snakemake's `--config`, with the numbers in lists and tables that it leaves as text."""
    return {key: _parse_nested(value) if isinstance(value, dict | list) else value for key, value in values.items()}


def _parse_nested(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _parse_nested(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_parse_nested(part) for part in value]
    return yaml.safe_load(value) if isinstance(value, str) else value


def check_config(config: Mapping) -> dict:
    """The config with all defaults, as plain values. Keys without a value (None) are left out.

    An alias counts before the key that it stands for.

    Raises: InputError: the first key that is unknown or out of range, and what it may be.
    """
    config = {key: value for key, value in config.items() if key not in ALIASES} | {
        key: config[alias] for alias, key in ALIASES.items() if alias in config
    }
    return check_model(Config, config).model_dump(mode="json", exclude_none=True)


def check_model(model: type[Model], values: Mapping, where: str = "") -> Model:
    """Validate values by a model. where: what stands before the keys in messages. Raises: InputError."""
    try:
        return model.model_validate(dict(values))
    except ValidationError as error:
        raise InputError(_describe_error(model, dict(values), error, where)) from None


def _read_yaml(file: Path) -> dict:
    try:
        values = yaml.safe_load(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{file}: not readable ({error.strerror})") from error
    except (yaml.YAMLError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        # PyYAML raises what int(), date() and its own tables do
        raise InputError(f"{file}: not YAML ({summarize_error(error)})") from error
    if not isinstance(values, dict):
        raise InputError(f"{file}: holds no keys; config/config.yaml is an example")
    return values


def _describe_error(model: type[BaseModel], values: dict, error: ValidationError, where: str) -> str:
    """One line: the key that is wrong, how, and what it may be."""
    errors = error.errors(include_url=False)
    first = next((e for e in errors if e["type"] == "extra_forbidden"), errors[0])
    location = first["loc"]
    if first["type"] == "value_error":
        assert "ctx" in first  # pydantic puts the raised error there
        message = str(first["ctx"]["error"])
    elif first["type"] == "extra_forbidden":
        message = _describe_unknown_key(model, location)
    elif first["type"] == "missing":
        message = "is missing"
    else:
        # of a value that may be of several kinds there is an error for each kind
        own = _keys_of(values, location)
        message = " or ".join(dict.fromkeys(lower_first(e["msg"]) for e in errors if _keys_of(values, e["loc"]) == own))
        if first["type"].endswith("_type") and isinstance(first["input"], dict) and first["input"]:
            message = f"there is no key {next(iter(first['input']))!r}; {message}"
    keys = [where] * bool(where) + [str(key) for key in _keys_of(values, location)]
    if first["type"] == "extra_forbidden":
        keys.pop()
    if first["type"] == "missing":
        keys.append(str(location[-1]))
    place = f"{'.'.join(keys)}: " if keys else ""
    return f"config: {place}{message} ({REFERENCE})"


def _keys_of(values: Any, location: tuple) -> list:
    """The part of an error's location that are keys of the config: pydantic adds names of kinds of values."""
    keys, entered = [], True
    for part in location:
        if isinstance(values, dict) and entered and part == values.get("kind"):  # a field has a key of its kind's name
            entered = False
            continue
        if isinstance(values, dict) and part in values or isinstance(values, list) and isinstance(part, int):
            keys.append(part)
            values, entered = values[part], True
    return keys


def _describe_unknown_key(model: type[BaseModel], location: tuple) -> str:
    unknown = str(location[-1])
    tables = list(iterate_tables(model))
    titles = {table["title"] for _, table in tables}
    where = [part for part in location[:-1] if part not in titles]  # pydantic adds the model that a value may be of
    known = next(
        list(table["properties"])
        for place, table in tables
        if len(place) == len(where) and all(p in (ANY, part) for p, part in zip(place, where, strict=True))
    )
    near = get_close_matches(unknown, known, 1, 0.55)  # finds `photo_count` for `photos`
    return f"there is no key {unknown!r}" + (f"; is {near[0]!r} meant?" if near else f", only {', '.join(known)}")
