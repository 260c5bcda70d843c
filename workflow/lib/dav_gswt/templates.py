"""HTML pages from Jinja2 templates."""

from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined, TemplateError

from dav_gswt.errors import InputError


def render_template(template: Path | str, values: dict[str, Any]) -> str:
    """The template filled with values, which are escaped as HTML unless they are `markupsafe.Markup`.

    Raises: InputError: the file is no template, or it uses a name that has no value.
    """
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    try:
        return environment.from_string(Path(template).read_text(encoding="utf-8")).render(values) + "\n"
    except TemplateError as error:
        raise InputError(f"{template}: not a template of this page ({error})") from error
