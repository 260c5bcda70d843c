"""What Snakemake says, told in short: which job of how many begins, where the log of one that failed is, no more."""

import re

_BEGINS = re.compile(r"(?:local)?(?:rule|checkpoint) (\w+):$")
_FAILS = re.compile(r"Error in rule (\w+):$")
_LOG = re.compile(r"    log: (.+?)(?: \(check log file\(s\) for error details\))?$")
_TOTAL = re.compile(r"total +(\d+)$")
_KILLED = re.compile(r"died with <Signals\.(SIG\w+)")
_NOISE = re.compile(
    r"""
    $ | \[\w{3}\ \w{3}\ +\d+\ [\d:]+\ \d+\]$                        # blank, or the time of day
    | Using\ (?:profile|workflow\ specific\ profile) | Config\ file\ .*\ is\ extended
    | Assuming\ unrestricted\ shared | Building\ DAG | Using\ shell | Provided\ cores | Rules\ claiming\ more
    | Select\ jobs\ to\ execute | Execute\ \d+\ jobs | Finished\ jobid | \d+\ of\ \d+\ steps | Reasons?:
    | Job\ stats: | job\ +count$ | -{3,}[\ -]*$
    | \ {4}(?:input|output|log|jobid|benchmark|reason|wildcards|threads|resources|message|shell|priority):?\ ?
    | RuleException: | CalledProcessError\ in | Command\ '.*'\ returned\ non-zero
    | InputFunctionException | MissingInputException\ in\ rule\ all | WorkflowError | At\ least\ one\ job\ did\ not
    | Error:$ | \ +WorkflowError:$ | Wildcards:$ | \ \ \w+=\S*$ | Traceback:$ | \ \ File\ ".*\.smk"
    | Removing\ output\ files\ of | Shutting\ down | Exiting\ because | Complete\ log | Elapsed\ time
    | Nothing\ to\ be\ done | Terminating\ processes | Cancelling\ snakemake
    """,
    re.VERBOSE,
)


class Narrator:
    """Shortens one run's lines, in their order. A line that it does not know goes through as it is."""

    def __init__(self):
        self.jobs = 0  # to do, without the rule that only names the targets
        self.begun = 0
        self._rule = ""
        self._failed = False
        self._counting = False
        self._removing = False

    def short(self, line: str) -> str | None:
        """What to show for a line; None for nothing."""
        line = line.rstrip()
        if self._counting and (total := _TOTAL.match(line)):
            self._counting, self.jobs = False, int(total[1]) - 1
            return f"{self.jobs} jobs to do"
        removed, self._removing = self._removing, line.startswith("Removing output files")
        if removed:  # the line after that one names them
            return None
        if line.startswith("Job stats:"):
            self._counting = True
        if self._counting and re.match(r"\w+ +\d+$", line):
            return None
        if found := _BEGINS.match(line) or _FAILS.match(line):
            self._rule, self._failed = found[1], bool(_FAILS.match(line))
            return None
        if self._rule and (log := _LOG.match(line)):
            return self._named(log[1])
        if killed := _KILLED.search(line):
            return f"  the job was killed ({killed[1]}); is there too little memory? A smaller quality needs less"
        return None if _NOISE.match(line) else line

    def _named(self, log: str) -> str:
        rule, self._rule = self._rule, ""
        if self._failed:
            return f"{rule} is not finished; its log: {log}"
        self.begun += 1
        return f"[{self.begun} of {self.jobs}] {rule}"
