"""What the Snakefile needs of Snakemake's internals, in one place."""


def lift_job_rate_limit(scheduler) -> None:
    """Lift Snakemake's default limit of 100 jobs a second; a limit that the user gave stays.

    With it the scheduler waits a second more after each finished job: after 200 jobs that takes a fifth of a core.
    `job_rate_limiter` is no public API: tests/workflow/test_snakemake_internals.py fails when it changes.
    """
    limiter = getattr(scheduler, "job_rate_limiter", None)
    if limiter and (limiter.max_jobs, limiter.timespan) == (100, 1):
        scheduler.job_rate_limiter = None
