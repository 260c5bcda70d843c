"""What the Snakefile needs of Snakemake's internals, in one place."""

from difflib import get_close_matches


def lift_job_rate_limit(scheduler) -> None:
    """Lift Snakemake's default limit of 100 jobs a second; a limit that the user gave stays.

    With it the scheduler waits a second more after each finished job: after 200 jobs that takes a fifth of a core.
    `job_rate_limiter` is no public API: tests/workflow/test_snakemake_internals.py fails when it changes.
    """
    limiter = getattr(scheduler, "job_rate_limiter", None)
    if limiter and (limiter.max_jobs, limiter.timespan) == (100, 1):
        scheduler.job_rate_limiter = None


class NamedEntries(dict):
    """A table of the config by name, whose error for a name that a path asks for says which names there are."""

    def __init__(self, table: str, entries: dict):
        super().__init__(entries)
        self.table = table

    def __missing__(self, name: str):
        from snakemake.exceptions import WorkflowError  # deferred: jobs unpickle tables, and it takes a second

        near = get_close_matches(name, self, 1)
        meant = f" (is {near[0]!r} meant?)" if near else ""
        raise WorkflowError(f"there is no {name!r} in {self.table}{meant}; it has {', '.join(self) or 'nothing'}")
