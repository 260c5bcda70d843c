"""Run the workflow at one extreme in a folder of its own, and tell whether the outcome was expected."""

import re
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml
from plyfile import PlyData

from dav_gswt.bundle.manifest import NAME
from dav_gswt.bundle.store import read_bundle
from dav_gswt.cli.run import PROFILE_NOTE, short_log
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.files import atomic_folder, read_json, write_json
from dav_gswt.images import image_files, metrics
from dav_gswt_study.stability.extremes import EXTREMES, Extreme

DEFAULT_CONFIG, TEST_CONFIG = "config/config.yaml", "config/test/config.yaml"
NUMERIC_FILES = ("*.ply", "*.csv", "*.json")  # files whose numbers must all be finite
TRACEBACK = "Traceback (most recent call last)"
NEAR_STILLS = ("walker", "oblique")  # stills that show single splats; from far above, sand has one colour
MIN_PSNR = 40.0  # dB between stills of worlds that differ in size alone: single roundings to 8 bits


def run_extreme(extreme: Extreme, root: Path, out: Path | str, cores: int, lpips: str = "installed") -> dict:
    """Run the workflow of a repository at an extreme; outcome.json, its output and its stills go to the folder `out`.

    A run that fails is an outcome like any other. lpips: as in the config.
    Returns the content of outcome.json.
    """
    with TemporaryDirectory(prefix="stability-") as place, atomic_folder(out) as part:
        folder = Path(place)
        if extreme.prepare:
            extreme.prepare(folder)
        (folder / "extreme.yaml").write_text(yaml.safe_dump({"lpips": lpips} | extreme.overrides), encoding="utf-8")
        files = [str(root / DEFAULT_CONFIG), str(root / TEST_CONFIG), "extreme.yaml"]
        command = [sys.executable, "-m", "snakemake", "--snakefile", str(root / "Snakefile"), "--directory", place]
        command += ["--cores", str(cores), "--scheduler", "greedy", "--logger", "davgswt", "--configfile", *files]
        start = time.monotonic()
        done = subprocess.run(
            command,
            cwd=folder,
            check=False,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=short_log(root),
        )
        seconds = time.monotonic() - start
        (part / "output.txt").write_text(done.stdout.replace(place, ""), encoding="utf-8")
        stills = {path.stem: path for path in folder.glob("results/**/terrain/*.png")}
        for name, path in stills.items():
            shutil.copy(path, part / f"{name}.png")
        outcome = describe_outcome(extreme, done.returncode, done.stdout.replace(f"{place}/", ""), folder)
        outcome |= {"seconds": seconds, "peak_mb": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024}
        write_json(part / "outcome.json", outcome)
    return outcome


def describe_outcome(extreme: Extreme, code: int, output: str, folder: Path) -> dict:
    """The outcome of a run. checked: number of files with numbers; not_finite: those with NaN or infinity."""
    logs = sorted(folder.glob("results/logs/**/*.log"))
    files = sorted(path for kind in NUMERIC_FILES for path in folder.glob(f"results/**/{kind}"))
    bad = [str(path.relative_to(folder)) for path in files if not is_finite(path)]
    return {
        "name": extreme.name,
        "exit_code": code,
        "message": extract_message(output) if code else None,
        "traceback": TRACEBACK in output or any(TRACEBACK in path.read_text(encoding="utf-8") for path in logs),
        "warnings": sorted({line for path in logs for line in read_warnings(path)}),
        "checked": len(files),
        "not_finite": bad,
        "gaussians": count_gaussians(folder),
    }


def extract_message(output: str) -> str:
    """The error message of a run that failed, as `make run` shows it, without lines of progress."""
    lines = [line for line in output.splitlines() if not line.startswith(PROFILE_NOTE)]
    all_lines = [line.strip() for line in lines if not line.startswith("[") and " to do" not in line]
    ends = [i for i, line in enumerate(lines) if line.startswith("[")]
    last = [line.strip() for line in lines[ends[-1] + 1 :]] if ends else all_lines
    return " / ".join(line for line in last if "is not finished; its log" not in line)


def read_warnings(log: Path) -> list[str]:
    """The warnings in the log of a job, without those about photos, of which the smallest experiment has too few."""
    lines = log.read_text(encoding="utf-8").splitlines()
    told = [line.split(" WARNING ", 1)[1] for line in lines if " WARNING " in line]
    return [line for line in told if not line.startswith("start view")]


def is_finite(path: Path) -> bool:
    """Whether all numbers in a file are finite."""
    if path.suffix == ".ply":
        rows = PlyData.read(str(path))["vertex"].data
        return all(np.isfinite(rows[name]).all() for name in rows.dtype.names)
    if path.name == NAME and not _is_bundle_finite(path.parent):
        return False
    words = path.read_text(encoding="utf-8").lower().replace(",", " ").replace(":", " ").split()
    return not {"nan", "inf", "-inf", "infinity", "-infinity"} & set(words)


def _is_bundle_finite(folder: Path) -> bool:
    """Whether a bundle can be read and the splats of its tiles are finite."""
    try:
        return all(_is_field_finite(field) for level in read_bundle(folder).fields() for field in level)
    except InputError:
        return False


def _is_field_finite(field: GaussianField) -> bool:
    """Whether the splats of a tile are finite once decoded."""
    with np.errstate(over="ignore"):
        deviations = np.exp(field.log_scales)
    return all(np.isfinite(part).all() for part in (field.means, deviations, field.quats, field.opacity_logits))


def count_gaussians(folder: Path) -> int | None:
    """Gaussians of the last field, from which tiles are cut; None without a field."""
    fields = list(folder.glob("results/*/seed*/*/active_*/iter*/field.ply"))
    return max((PlyData.read(str(path))["vertex"].count for path in fields), default=None)


def tabulate_runs(root: Path | str) -> list[dict]:
    """A row for each extreme. root: the folder that holds the runs' folders."""
    return [tabulate_run(extreme, Path(root)) for extreme in EXTREMES.values()]


def tabulate_run(extreme: Extreme, root: Path) -> dict:
    """The outcome of a run, and whether it was expected."""
    outcome = read_json(root / extreme.name / "outcome.json")
    finished = outcome["exit_code"] == 0
    blank = [name for name in NEAR_STILLS if finished and is_blank(root / extreme.name / f"{name}.png")]
    psnr = compare_stills(root / extreme.name, root / extreme.same_as) if extreme.same_as else None
    row = {key: outcome[key] for key in ("exit_code", "message", "traceback")}
    row |= {"files_checked": outcome["checked"], "not_finite": len(outcome["not_finite"]), "blank_stills": len(blank)}
    row |= {"like": extreme.same_as, "stills_psnr": psnr}
    row |= {"warnings": " / ".join(outcome["warnings"])}
    cost = {"gaussians": outcome["gaussians"], "seconds": round(outcome["seconds"], 1)}
    expected = "message" if extreme.error_pattern else "ends"
    as_expected = (has_failed_as_expected if extreme.error_pattern else has_finished)(extreme, row)
    about = {"run": extreme.name, "about": extreme.about, "expected": expected, "as_expected": as_expected}
    return about | row | cost | {"peak_mb": round(outcome["peak_mb"])}


def has_failed_as_expected(extreme: Extreme, row: dict) -> bool:
    """Whether the run stopped with the expected message, without a traceback."""
    message = row["message"] or ""
    return (
        row["exit_code"] != 0 and not row["traceback"] and re.search(extreme.error_pattern or "", message) is not None
    )


def has_finished(extreme: Extreme, row: dict) -> bool:
    """Whether the run finished, all numbers are finite, and the stills show something, and what they should equal."""
    faults = row["exit_code"] or row["traceback"] or row["not_finite"] or row["blank_stills"]
    return not faults and (row["stills_psnr"] is None or row["stills_psnr"] >= MIN_PSNR)


def is_blank(path: Path) -> bool:
    """Whether the lower half of a picture has one colour."""
    picture = image_files.read_photo(path)
    return float(picture[len(picture) // 2 :].std((0, 1)).max()) < 1 / 255


def compare_stills(folder: Path, other: Path) -> float | None:
    """PSNR over all stills of two runs, at most 100; None where one of them has no still."""
    pairs = [(path, other / path.name) for path in sorted(folder.glob("*.png"))]
    if not pairs or not all(second.is_file() for _, second in pairs):
        return None
    a, b = (np.concatenate([image_files.read_photo(pair[i]) for pair in pairs]) for i in (0, 1))
    psnr = metrics.psnr(a, b, np.ones(a.shape[:2], np.float32))
    return 100.0 if psnr is None else min(100.0, float(psnr))
