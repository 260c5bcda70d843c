"""What the Snakefile takes from Snakemake that is no public API: this fails when it changes."""

import inspect
from types import SimpleNamespace

from snakemake.scheduling import job_scheduler
from snakemake.settings.types import MaxJobsPerTimespan

from dav_gswt.workflow import lift_job_rate_limit


def scheduler(limit: str) -> SimpleNamespace:
    return SimpleNamespace(job_rate_limiter=job_scheduler.JobRateLimiter(MaxJobsPerTimespan.parse_choice(limit)))


def test_the_scheduler_has_a_limiter_of_this_name():
    assert "self.job_rate_limiter" in inspect.getsource(job_scheduler.JobScheduler.__init__)


def test_the_default_limit_is_lifted():
    lifted = scheduler("100/1s")
    lift_job_rate_limit(lifted)
    assert lifted.job_rate_limiter is None


def test_a_limit_that_the_user_gave_stays():
    kept = scheduler("10/1s")
    lift_job_rate_limit(kept)
    assert kept.job_rate_limiter.max_jobs == 10
