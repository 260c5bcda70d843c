"""Run the workflow at one extreme in a folder of its own, and describe the outcome."""

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

from dav_gswt.bundle import chunks
from dav_gswt.bundle.chunks import ChunkEntry
from dav_gswt.bundle.encoding import Encoding
from dav_gswt.cli.run import PROFILE_NOTE, short_log
from dav_gswt.files import atomic_folder, read_json, write_json
from dav_gswt_study.stability.extremes import Extreme

DEFAULT_CONFIG, TEST_CONFIG = "config/config.yaml", "config/test/config.yaml"
NUMERIC_FILES = ("*.ply", "*.csv", "*.json", "lod*.bin")  # files whose numbers must all be finite
TRACEBACK = "Traceback (most recent call last)"


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
    all_lines = [line.strip() for line in lines if not line.startswith("[") and "jobs to do" not in line]
    ends = [i for i, line in enumerate(lines) if line.startswith("[")]
    last = [line.strip() for line in lines[ends[-1] + 1 :]] if ends else all_lines
    return " / ".join(line for line in last if "is not finished; its log" not in line)


def read_warnings(log: Path) -> list[str]:
    """The warnings in the log of a job."""
    lines = log.read_text(encoding="utf-8").splitlines()
    return [line.split(" WARNING ", 1)[1] for line in lines if " WARNING " in line]


def is_finite(path: Path) -> bool:
    """Whether all numbers in a file are finite."""
    if path.suffix == ".ply":
        rows = PlyData.read(str(path))["vertex"].data
        return all(np.isfinite(rows[name]).all() for name in rows.dtype.names)
    if path.suffix == ".bin":
        return _is_chunk_finite(path)
    words = path.read_text(encoding="utf-8").lower().replace(",", " ").replace(":", " ").split()
    return not {"nan", "inf", "-inf", "infinity", "-infinity"} & set(words)


def _is_chunk_finite(path: Path) -> bool:
    """Whether the splats of a chunk are finite once decoded by its manifest."""
    manifest = read_json(path.parents[1] / "davgswt.json")
    entries = [chunk for tile in manifest["tiles"] for chunk in tile["chunks"]]
    entry = next(entry for entry in entries if entry["file"] == f"chunks/{path.name}")
    field, _ = chunks.read_chunk(path.parents[1], ChunkEntry(**entry), Encoding(**manifest["encoding"]))
    with np.errstate(over="ignore"):
        deviations = np.exp(field.log_scales)
    return all(np.isfinite(part).all() for part in (field.means, deviations, field.quats, field.opacity_logits))


def count_gaussians(folder: Path) -> int | None:
    """Gaussians of the last field, from which tiles are cut; None without a field."""
    fields = list(folder.glob("results/*/seed*/*/active_*/iter*/field.ply"))
    return max((PlyData.read(str(path))["vertex"].count for path in fields), default=None)
