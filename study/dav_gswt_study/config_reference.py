"""Write the reference of the study's keys: `make docs`."""

from reference import describe_tables, write_files  # workflow/reference.py

from dav_gswt_study.config import StudyConfig

HEAD = "# The study's keys\n\nKeys of `study:`, in `study/config.yaml`. Made by `make docs`."


def make_reference() -> dict[str, str]:
    """The text of each file that is made from the study's models, by its path in the repository."""
    return {"study/docs/config.md": f"{HEAD}\n\n{describe_tables(StudyConfig, ('study',))}\n"}


if __name__ == "__main__":
    write_files(make_reference())
