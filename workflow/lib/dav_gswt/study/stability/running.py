"""One extreme run, in a folder of its own: what it said, whether its numbers are finite, what it cost."""

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
from dav_gswt.bundle.encoding import Encoding
from dav_gswt.cli.log_filter import Narrator
from dav_gswt.files import read_json, whole_folder, write_json
from dav_gswt.images.lpips_weights import PATH as LPIPS
from dav_gswt.study.stability.extremes import Extreme

USUAL, TINY = "config/config.yaml", "config/test/config.yaml"
NUMBERS = ("*.ply", "*.csv", "*.json", "lod*.bin")  # files whose numbers are all to be finite
TRACEBACK = "Traceback (most recent call last)"


def run(extreme: Extreme, root: Path, out: Path | str, cores: int, lpips: Path | str | None = None) -> dict:
    """Run the workflow of a repository at an extreme; outcome.json, what it said and its stills go to the folder `out`.

    A run that fails is an outcome like any other. lpips: its weights; without them the term is left out.
    Returns what outcome.json holds.
    """
    with TemporaryDirectory(prefix="stability-") as place, whole_folder(out) as part:
        folder = Path(place)
        if extreme.prepare:
            extreme.prepare(folder)
        if lpips:
            (folder / LPIPS).parent.mkdir(parents=True)
            shutil.copy(lpips, folder / LPIPS)
        prior = {"priors": {"terrain": {"lpips": bool(lpips)}}}
        (folder / "extreme.yaml").write_text(yaml.safe_dump(prior | extreme.over), encoding="utf-8")
        files = [str(root / USUAL), str(root / TINY), "extreme.yaml"]
        command = [sys.executable, "-m", "snakemake", "--snakefile", str(root / "Snakefile"), "--directory", place]
        command += ["--cores", str(cores), "--scheduler", "greedy", "--configfile", *files]
        start = time.monotonic()
        done = subprocess.run(
            command, cwd=folder, check=False, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        seconds = time.monotonic() - start
        (part / "said.txt").write_text(done.stdout.replace(place, ""), encoding="utf-8")
        stills = {path.stem: path for path in folder.glob("results/**/terrain/*.png")}
        for name, path in stills.items():
            shutil.copy(path, part / f"{name}.png")
        found = told(extreme, done.returncode, done.stdout.replace(f"{place}/", ""), folder)
        found |= {"seconds": seconds, "peak_mb": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024}
        write_json(part / "outcome.json", found)
    return found


def told(extreme: Extreme, code: int, said: str, folder: Path) -> dict:
    """What came of a run. checked: files whose numbers were looked at; not_finite: those of them with others."""
    logs = sorted(folder.glob("results/logs/**/*.log"))
    looked = sorted(path for kind in NUMBERS for path in folder.glob(f"results/**/{kind}"))
    bad = [str(path.relative_to(folder)) for path in looked if not finite(path)]
    return {
        "name": extreme.name,
        "exit_code": code,
        "message": message(said) if code else None,
        "traceback": TRACEBACK in said or any(TRACEBACK in path.read_text(encoding="utf-8") for path in logs),
        "warnings": sorted({line for path in logs for line in warnings(path)}),
        "checked": len(looked),
        "not_finite": bad,
        "gaussians": gaussians(folder),
    }


def message(said: str) -> str:
    """What a user reads of a run that failed: the lines that are no progress, as `make run` shortens them."""
    narrator = Narrator()
    lines = [text for line in said.splitlines() if (text := narrator.short(line)) is not None]
    told = [line.strip() for line in lines if not line.startswith("[") and "jobs to do" not in line]
    ends = [i for i, line in enumerate(lines) if line.startswith("[")]
    last = [line.strip() for line in lines[ends[-1] + 1 :]] if ends else told
    return " / ".join(line for line in last if "is not finished; its log" not in line)


def warnings(log: Path) -> list[str]:
    """What a job warned of."""
    lines = log.read_text(encoding="utf-8").splitlines()
    return [line.split(" WARNING ", 1)[1] for line in lines if " WARNING " in line]


def finite(path: Path) -> bool:
    """Whether all numbers in a file are finite."""
    if path.suffix == ".ply":
        rows = PlyData.read(str(path))["vertex"].data
        return all(np.isfinite(rows[name]).all() for name in rows.dtype.names)
    if path.suffix == ".bin":
        return _records_finite(path)
    words = path.read_text(encoding="utf-8").lower().replace(",", " ").replace(":", " ").split()
    return not {"nan", "inf", "-inf", "infinity", "-infinity"} & set(words)


def _records_finite(path: Path) -> bool:
    """Of a chunk: its manifest says how to read it."""
    manifest = read_json(path.parents[1] / "davgswt.json")
    entries = [chunk for tile in manifest["tiles"] for chunk in tile["chunks"]]
    entry = next(entry for entry in entries if entry["file"] == f"chunks/{path.name}")
    field, _ = chunks.read(path.parents[1], entry, Encoding.of_json(manifest["encoding"]))
    with np.errstate(over="ignore"):
        deviations = np.exp(field.log_scales)
    return all(np.isfinite(part).all() for part in (field.means, deviations, field.quats, field.opacity_logits))


def gaussians(folder: Path) -> int | None:
    """Of the field that levels and tiles were made of."""
    fields = list(folder.glob("results/*/seed*/*/active_*/iter*/field.ply"))
    return max((PlyData.read(str(path))["vertex"].count for path in fields), default=None)
