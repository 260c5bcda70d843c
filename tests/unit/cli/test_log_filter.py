import pytest

from dav_gswt.cli.log_filter import Narrator

START = """\
Config file config/config.yaml is extended by additional config specified via the command line.
Assuming unrestricted shared filesystem usage.
Building DAG of jobs...
Using shell: /usr/bin/bash
Provided cores: 2
Rules claiming more threads will be scaled down.
Job stats:
job            count
-----------  -------
fit_coarse         1
fit_level          1
all                1
total              3

Select jobs to execute...
Execute 1 jobs...

[Sat Nov 21 06:04:19 2026]
localrule fit_coarse:
    input: photos/a.jpg
    output: results/a/field.ply
    log: results/logs/a/fit_coarse.log
    jobid: 8
    benchmark: results/benchmarks/a/fit_coarse.tsv
    wildcards: scene=a
    threads: 2
    resources: tmpdir=/tmp, runtime=60
"""
ENDS = """\
[Sat Nov 21 06:04:21 2026]
Finished jobid: 8 (Rule: fit_coarse)
1 of 3 steps (33%) done
Select jobs to execute...
rule fit_level:
    log: results/logs/a/fit_level1.log
"""
FAILS = """\
  a.jpg: cut short; copy it again
RuleException:
CalledProcessError in file "/a/rules/photos.smk", line 32:
Command 'set -euo pipefail;  python fit_coarse.py' returned non-zero exit status 1.
Error in rule fit_coarse:
    message: None
    log: results/logs/a/fit_coarse.log (check log file(s) for error details)
Removing output files of failed job fit_coarse since they might be corrupted:
results/a/field.ply
Shutting down, this might take some time.
Exiting because a job execution failed. Look above for error messages
Complete log(s): /a/.snakemake/log/2026.snakemake.log
WorkflowError:
At least one job did not complete successfully.
"""


def told(text: str) -> list[str]:
    narrator = Narrator()
    return [short for line in text.splitlines(keepends=True) if (short := narrator.short(line)) is not None]


def test_each_job_that_begins_is_one_line_with_its_number():
    assert told(START + "  fit: 3/9, 00:05 gone\n" + ENDS) == [
        "2 jobs to do",
        "[1 of 2] fit_coarse",
        "  fit: 3/9, 00:05 gone",
        "[2 of 2] fit_level",
    ]


def test_a_job_that_fails_is_its_own_message_and_its_log():
    assert told(START + FAILS)[2:] == [
        "  a.jpg: cut short; copy it again",
        "fit_coarse is not finished; its log: results/logs/a/fit_coarse.log",
    ]


def test_a_job_that_the_system_killed_is_explained():
    line = "Command 'set -euo pipefail;  python fit_coarse.py' died with <Signals.SIGKILL: 9>.\n"
    assert "SIGKILL" in told(START + line)[-1] and "memory" in told(START + line)[-1]


@pytest.mark.parametrize(
    "line",
    [
        "MissingRuleException:",
        "Traceback (most recent call last):",
        '  File "scripts/fit_coarse.py", line 3, in <module>',
        "    raise ValueError(text)",
        "config: tau: 2 is greater than the maximum of 1",
        "  total 12 photos",
    ],
)
def test_what_is_not_known_goes_through(line):
    assert told(START + line + "\n")[-1] == line
