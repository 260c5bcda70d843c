"""Write the key reference and the schema of the config: `python -m dav_gswt.study.config_reference`."""

from pathlib import Path

from dav_gswt.bundle import manifest
from dav_gswt.config.model import Config
from dav_gswt.study.config import StudyConfig
from dav_gswt.study.config_tables import HEAD, describe_policies, describe_tables, make_schema
from dav_gswt.study.reruns import describe_reruns

STUDY_HEAD = "## Study\n\nKeys of `study:`, in `config/study.yaml`."


def make_reference() -> dict[str, str]:
    """The text of each file that is made from the config models, by its path in the repository."""
    keys = [HEAD, "## Product", describe_tables(Config), STUDY_HEAD, describe_tables(StudyConfig, ("study",))]
    return {
        "docs/reference/config.md": "\n\n".join(part.strip() for part in keys) + "\n",
        "docs/reference/policies.md": describe_policies(),
        "docs/reference/reruns.md": describe_reruns(),
        "workflow/schemas/config.schema.json": make_schema(),
        "workflow/schemas/davgswt.schema.json": manifest.make_schema(),
    }


if __name__ == "__main__":
    for name, text in make_reference().items():
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text(text, encoding="utf-8")
