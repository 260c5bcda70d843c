"""Faults that a run must survive, tried on the smallest experiment: `make faults`.

Every series ends with a run that is let go on, and compares the bytes of what it made with those of a run that nothing
disturbed. A strike is lost where they differ, where the run does not go on, or where a message is missing. What was
tried is kept in a file, a line each; started again, it goes on with what is missing, as long as the code is the same.
"""

import argparse
import json
import os
import random
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from faults import trials
from faults.experiment import ROOT, Experiment, Reference
from faults.trials import Strike, Trial

from dav_gswt.files import digest_files

KILLS = "kill -9 of all"
SERIES: dict[str, list[Callable[[Trial], list[Strike]]]] = {
    "kill -9 of a job": [trials.kill_jobs],
    "full disk": [trials.fill_disk],
    "memory limit": [trials.limit_memory],
    "read-only results": [trials.forbid_writing],
    "clock jump": [trials.set_clock],
    "two runs at once": [trials.run_twice],
    "late files": [trials.delay_files],
    "files too late": [trials.delay_files_too_long],
}
ROOT_ONLY = "read-only results"


@dataclass(frozen=True)
class Entry:
    """A series in the file. code: a digest of what ran; series: its number within the fault."""

    code: str
    fault: str
    series: int
    strikes: list[dict]


class Ledger:
    """The series that were tried with this code."""

    def __init__(self, path: Path, code: str):
        self.path, self.code = path, code
        lines = path.read_text().splitlines() if path.exists() else []
        entries = [Entry(**json.loads(line)) for line in lines]
        self.entries = [entry for entry in entries if entry.code == code]

    def add(self, fault: str, series: int, strikes: list[Strike]) -> None:
        entry = Entry(self.code, fault, series, [asdict(strike) for strike in strikes])
        self.entries.append(entry)
        with self.path.open("a") as file:
            file.write(json.dumps(asdict(entry)) + "\n")

    def has(self, fault: str, series: int) -> bool:
        return any((entry.fault, entry.series) == (fault, series) for entry in self.entries)

    def list_strikes(self, fault: str) -> list[Strike]:
        return [Strike(**each) for entry in self.entries if entry.fault == fault for each in entry.strikes]

    def count_stages(self, fault: str) -> Counter:
        return Counter(strike.stage for strike in self.list_strikes(fault))

    def write_table(self) -> str:
        """Of every fault how many strikes there were, in how many stages, and how many a run survived."""
        lines = ["| fault | stages | tried | survived | lost |", "|---|---:|---:|---:|---:|"]
        for fault in dict.fromkeys(entry.fault for entry in self.entries):
            strikes = self.list_strikes(fault)
            lost = sum(bool(strike.complaints) for strike in strikes)
            counts = [len(self.count_stages(fault)), len(strikes), len(strikes) - lost, lost]
            lines.append(f"| {fault} | {' | '.join(map(str, counts))} |")
        return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=100, help="random moments at which a run is killed")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--only", nargs="*", default=[KILLS, *SERIES], help="names of faults")
    parser.add_argument("--out", type=Path, default=ROOT / "results/faults", help="folder of the ledger and the table")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    code = digest_code()
    ledger = Ledger(options.out / "trials.jsonl", code)
    with tempfile.TemporaryDirectory(prefix="faults-") as place:
        wanted = find_reference(options.out / f"undisturbed-{code}.json", Path(place), options.cores)
        for fault, series, function in list_series(options.only, ledger, options.kills):
            rng = random.Random(f"{options.seed} {fault} {series}")
            folder = Path(place) / "series"
            ledger.add(fault, series, function(Trial(fault, folder, wanted, rng, options.cores)))
            shutil.rmtree(folder)
            report(ledger, fault, wanted)
    (options.out / "table.md").write_text(ledger.write_table() + "\n")
    print(ledger.write_table())
    sys.exit(any(each["complaints"] for entry in ledger.entries for each in entry.strikes))


def digest_code() -> str:
    """Eight digits for the code that runs, apart from the tests."""
    folders = [ROOT / name for name in ("workflow", "rules", "scripts", "config", "Snakefile")]
    files = [p for f in folders for p in (f.rglob("*") if f.is_dir() else [f])]
    return digest_files(*sorted(p for p in files if p.is_file() and p.suffix != ".pyc"))[:8]


def find_reference(path: Path, place: Path, cores: int) -> Reference:
    """The undisturbed run: of an earlier call, or made now."""
    if not path.exists():
        reference = Experiment(place / "undisturbed", cores).record()
        path.write_text(json.dumps(asdict(reference)))
    return Reference(**json.loads(path.read_text()))


def list_series(only: list[str], ledger: Ledger, kills: int) -> Iterator[tuple[str, int, Callable]]:
    """The series that are missing; runs are killed until there are enough strikes."""
    for fault in only:
        for series, function in enumerate(SERIES.get(fault, [])):
            if os.geteuid() and fault == ROOT_ONLY:
                print(f"{fault}: mounting needs root; left out")
            elif not ledger.has(fault, series):
                yield fault, series, function
    while KILLS in only and (tried := len(ledger.list_strikes(KILLS))) < kills:
        yield KILLS, sum(entry.fault == KILLS for entry in ledger.entries), trials.kill_runs
        if len(ledger.list_strikes(KILLS)) == tried:
            raise RuntimeError("no run could be killed")


def report(ledger: Ledger, fault: str, wanted: Reference) -> None:
    """Print what came of a fault up to now."""
    strikes, stages = ledger.list_strikes(fault), ledger.count_stages(fault)
    survived = sum(not strike.complaints for strike in strikes)
    missed = [stage for stage in wanted.stages if not stages[stage]]
    print(f"{fault}: {survived} of {len(strikes)} survived; never in {', '.join(missed) or 'none'}", flush=True)
    for line in dict.fromkeys(line for strike in strikes for line in strike.complaints):
        print("  ", line, flush=True)


if __name__ == "__main__":
    main()
