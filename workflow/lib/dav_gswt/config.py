"""The config is closed: what is misspelt or out of range is named before the first job starts."""

from pathlib import Path

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from dav_gswt.errors import InputError


def check(config: dict, schema: Path) -> None:
    """Check a config against its schema and against itself.

    Raises: InputError: the key, what is wrong with it, and what it may be.
    """
    rules = yaml.safe_load(schema.read_text(encoding="utf-8"))
    if error := best_match(Draft202012Validator(rules).iter_errors(config)):
        key = ".".join(str(p) for p in error.absolute_path) or "config"
        raise InputError(f"config: {key}: {error.message} (config/README.md lists every key)")
    if config["scene"] not in config["scenes"]:
        raise InputError(f"config: scene: there is no {config['scene']!r}; scenes has {', '.join(config['scenes'])}")
    for name, scene in config["scenes"].items():
        for key, table in (("quality", "qualities"), ("seam", "seams")):
            if scene[key] not in config[table]:
                known = ", ".join(config[table])
                raise InputError(f"config: scenes.{name}.{key}: there is no {scene[key]!r}; {table} has {known}")
