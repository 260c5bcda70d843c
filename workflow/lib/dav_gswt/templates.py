"""HTML pages from Jinja2 templates."""

from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined


def render_template(template: Path | str, values: dict[str, Any]) -> str:
    """The template filled with values, which are escaped as HTML unless they are `markupsafe.Markup`."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(Path(template).read_text(encoding="utf-8")).render(values) + "\n"
