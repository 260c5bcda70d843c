"""Write the reference of the study's keys: `python -m dav_gswt.study.config_reference`."""

from dav_gswt.config.reference import describe_tables, write_files
from dav_gswt.study.config import StudyConfig
from dav_gswt.study.reruns import describe_reruns

HEAD = "# The study's keys\n\nKeys of `study:`, in `config/study.yaml`. Made by `make reference`."


def make_reference() -> dict[str, str]:
    """The text of each file that is made from the study's models, by its path in the repository."""
    return {
        "docs/research/config.md": f"{HEAD}\n\n{describe_tables(StudyConfig, ('study',))}\n",
        "docs/reference/reruns.md": describe_reruns(),
    }


if __name__ == "__main__":
    write_files(make_reference())
