"""Put deliberate faults (mutants) into the code, one at a time, and see whether the tests find them.

    python tests/mutants --seed 0 --count 20

Mutants are drawn by seed: a group of code (a package of the library, the C++ core, the viewer), then a kind of fault,
then a place, found by syntax tree. Each is put into a copy of the repository, where `make test` runs with -x, the
tests nearest to the fault first; survivors are tested by the slow tests too. Results are in
results/mutants/seed<N>.json, and an interrupted run goes on from there. This is a tool, not part of the test suite.
"""

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from faults import Mutant, list_mutants

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = Path("workflow/lib/dav_gswt")
LIMIT = 3600  # seconds of a test run: a mutant may never end


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--list", action="store_true", help="print the mutants and test nothing")
    parser.add_argument("--fast-only", action="store_true", help="do not test survivors by `make test-all`")
    options = parser.parse_args()
    drawn = draw_mutants(options.seed, options.count)
    if options.list:
        for mutant in drawn:
            print(mutant.describe())
        return 0
    record = ROOT / f"results/mutants/seed{options.seed}.json"
    record.parent.mkdir(parents=True, exist_ok=True)
    known = json.loads(record.read_text()) if record.is_file() else {}
    with tempfile.TemporaryDirectory(prefix="mutants") as folder:
        copy = copy_repository(Path(folder) / "copy")
        if not known and (failed := run_tests(copy, None, fast=True)) != "survived":
            print(f"The tests fail without a fault: {failed}")
            return 1
        for number, mutant in enumerate(drawn):
            found = known.setdefault(mutant.describe(), {})
            if "fast" not in found:
                found |= try_mutant(copy, mutant, fast=True)
                record.write_text(json.dumps(known, indent=1))
            if found["fast"] == "survived" and "slow" not in found and not options.fast_only:
                found |= try_mutant(copy, mutant, fast=False)
                record.write_text(json.dumps(known, indent=1))
            print(f"[{number + 1} of {len(drawn)}] {describe_result(found)}\n{mutant.describe()}\n", flush=True)
    report([known[mutant.describe()] for mutant in drawn])
    return 0


def draw_mutants(seed: int, count: int) -> list[Mutant]:
    """Mutants by seed: groups in turn, in an order that is drawn; of each group a kind, then a place."""
    rng, chosen = random.Random(seed), []
    groups = {name: list_mutants(ROOT, paths) for name, paths in sorted(list_groups().items())}
    while len(chosen) < count:
        for name in rng.sample(sorted(groups), len(groups)):
            by_kind = {}
            for mutant in groups[name]:
                by_kind.setdefault(mutant.kind, []).append(mutant)
            mutant = rng.choice(by_kind[rng.choice(sorted(by_kind))])
            groups[name].remove(mutant)
            chosen.append(mutant)
    return chosen[:count]


def list_groups() -> dict[str, list[Path]]:
    """Source files by group: packages of the library, its own modules, the C++ core, the viewer."""
    groups = {}
    for path in sorted((ROOT / LIBRARY).rglob("*")):
        parts = path.relative_to(ROOT / LIBRARY).parts
        if path.suffix == ".py":
            groups.setdefault(parts[0] if len(parts) > 1 else "modules", []).append(path.relative_to(ROOT))
        elif path.suffix in (".cpp", ".h"):
            groups.setdefault("core", []).append(path.relative_to(ROOT))
    groups["viewer"] = [path.relative_to(ROOT) for path in sorted((ROOT / "workflow/viewer").rglob("*.js"))]
    return groups


def copy_repository(copy: Path) -> Path:
    """Copy the tracked files, and make an environment whose packages are links to this environment's packages."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in listed.split("\0")[:-1]:
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, copy / name, follow_symlinks=False)
    site = Path(f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages")
    environment, packages = copy / ".venv", ROOT / ".venv" / site
    (environment / site).mkdir(parents=True)
    for entry in packages.iterdir():
        place = environment / site / entry.name
        if entry.name.startswith("_editable_") and entry.is_file():
            place.write_text(entry.read_text().replace(str(ROOT), str(copy)))
        elif entry.name == "dav_gswt":  # the compiled core: made again for mutants of it
            shutil.copytree(entry, place)
        elif entry.name != "__pycache__":
            place.symlink_to(entry)
    (environment / "bin").mkdir()
    for entry in (ROOT / ".venv/bin").iterdir():
        place = environment / "bin" / entry.name
        if entry.is_symlink():
            place.symlink_to(entry.readlink())
        elif str(ROOT).encode() in entry.read_bytes()[:200]:
            place.write_text(entry.read_text().replace(str(ROOT), str(copy)))
            place.chmod(0o755)
        else:
            shutil.copy(entry, place)
    shutil.copy(ROOT / ".venv/pyvenv.cfg", environment)
    if (ROOT / "tests/browser/node_modules").is_dir():
        (copy / "tests/browser/node_modules").symlink_to(ROOT / "tests/browser/node_modules")
    touch_stamps(copy)
    return copy


def touch_stamps(copy: Path) -> None:
    """The environment counts as set up: it is newer than what it is made from."""
    for name in ("installed", "installed-docs", "installed-test"):
        (copy / ".venv" / name).touch()


def try_mutant(copy: Path, mutant: Mutant, fast: bool) -> dict:
    """Put a mutant into the copy, run the tests of a tier, take it out again. Returns the result and the seconds."""
    path, tier = copy / mutant.path, "fast" if fast else "slow"
    original = path.read_text()
    start = time.monotonic()
    try:
        path.write_text(mutant.apply(original))
        result = run_tests(copy, mutant, fast)
    finally:
        path.write_text(original)
        if path.suffix in (".cpp", ".h"):
            build_core(copy)
    return {tier: result, f"{tier}_seconds": round(time.monotonic() - start)}


def run_tests(copy: Path, mutant: Mutant | None, fast: bool) -> str:
    """The name of a test that fails, or `survived`."""
    if mutant and mutant.path.suffix in (".cpp", ".h") and build_core(copy):
        return "it does not compile"
    touch_stamps(copy)
    nearest = [place for place in list_nearest_tests(mutant.path) if (copy / place).exists()] if mutant else []
    marked = "" if fast else " -m slow"
    for tests in (" ".join(nearest), "") if nearest else ("",):
        command = ["make", "test", f"PYTEST_OPTIONS=-x -q -p no:cacheprovider{marked}", f"TESTS={tests}"]
        job = subprocess.Popen(command, cwd=copy, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               errors="replace", start_new_session=True)  # fmt: skip
        try:
            out, _ = job.communicate(timeout=LIMIT)
        except subprocess.TimeoutExpired:
            os.killpg(job.pid, 9)
            job.communicate()
            return f"no end within {LIMIT} s"
        if job.returncode:
            failed = [line for line in out.splitlines() if line.startswith(("FAILED", "ERROR"))]
            return failed[0][:300] if failed else out.strip()[-300:]
    return "survived"


def list_nearest_tests(path: Path) -> list[str]:
    """Tests of the same package, which run first."""
    if path.is_relative_to("workflow/viewer"):
        return ["tests/browser"]
    parts = path.relative_to(LIBRARY).parts
    return [f"tests/unit/{parts[0]}"] if len(parts) > 1 else [f"tests/unit/test_{path.stem}.py"]


def build_core(copy: Path) -> bool:
    """Compile the C++ core of the copy. Returns: did that fail?"""
    command = [copy / ".venv/bin/python", "-m", "pip", "install", "--quiet", "--no-build-isolation", "--no-deps"]
    done = subprocess.run([*command, "--editable", "."], cwd=copy, capture_output=True, check=False)
    touch_stamps(copy)
    return done.returncode != 0


def describe_result(found: dict) -> str:
    text = f"{found['fast']} ({found['fast_seconds']} s)"
    if "slow" in found:
        text += f"; with the slow tests: {found['slow']} ({found['slow_seconds']} s)"
    return text


def report(results: list[dict]) -> None:
    """Print how many mutants each tier caught."""
    fast = sum(found["fast"] != "survived" for found in results)
    both = sum(found["fast"] != "survived" or found.get("slow", "survived") != "survived" for found in results)
    print(f"make test: {fast} of {len(results)} mutants caught; with the slow tests: {both} of {len(results)}")


if __name__ == "__main__":
    sys.exit(main())
