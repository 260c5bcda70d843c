"""What all config models share: closed, frozen models and the types of their values."""

import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints
from pydantic.config import JsonDict

from dav_gswt.paths import NAME, RESERVED


class ConfigModel(BaseModel):
    """A table of the config: unknown keys are errors, values do not change, numbers are never made from text."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def _require_name(name: str) -> str:
    if not re.fullmatch(NAME, name):
        raise ValueError(
            f"{name!r} is no name: small letters, digits, - and _, from a letter, and none of {', '.join(RESERVED)}"
        )
    return name


Name = Annotated[str, AfterValidator(_require_name)]
Text = Annotated[str, StringConstraints(min_length=1)]
Seed = Annotated[int, Field(ge=0, le=2**32 - 1)]
Degrees = Annotated[float, Field(ge=-360, le=360)]
Share = Annotated[float, Field(ge=0, le=1)]
Auto = Literal["auto"]

LARGEST_SIDE = 16_384  # pixels of a photo


def _replace_native(size: int | str) -> int:
    return LARGEST_SIDE if isinstance(size, str) else size


# the longer side of photos, which are never enlarged; `native`: as they are
PhotoSize = Annotated[
    Annotated[int, Field(ge=32, le=LARGEST_SIDE)] | Literal["native"], AfterValidator(_replace_native)
]


def key(description: str, default: Any = ..., *, unit: str = "", renamed: str = "", **bounds) -> Any:
    """A key of a table: meaning, default, unit and bounds; `renamed`: its name in old config files."""
    extra: JsonDict = {name: value for name, value in (("unit", unit), ("renamed", renamed)) if value}
    return Field(default, description=description, json_schema_extra=extra or None, **bounds)
