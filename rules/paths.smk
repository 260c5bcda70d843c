"""Shared by all stages: the checked config, the result tree (dav_gswt.paths), and what a scene's targets are."""

import re
from pathlib import Path

from dav_gswt import paths
from dav_gswt.capture.agents import AGENTS
from dav_gswt.code_digest import LIBRARY, digest_code
from dav_gswt.config.base import select_keys
from dav_gswt.config.load import add_scene_files, check_config, merge_tables, parse_command_line
from dav_gswt.config.scenes import SCENES
from dav_gswt.config.settings import Export, Preset
from dav_gswt.errors import InputError
from dav_gswt.files import is_from_future, locate_path
from dav_gswt.images.lpips_weights import locate_weights
from dav_gswt.paths import INPAINTED, NATURAL, POSITIVE, SNAPSHOTS
from dav_gswt.photos.geo_file import list_geo_files
from dav_gswt.photos.photo_listing import drop_twins, list_photos, locate_source
from dav_gswt.sweeps import CELL
from dav_gswt.views.policies import NEEDS_PHOTOS, POLICY_NAMES, PRIOR_POLICIES
from dav_gswt.workflow import NamedEntries, lift_job_rate_limit

BASE = Path(str(workflow.current_basedir)).parent
VIEWER = sorted(
    str(path) for path in (BASE / "workflow/viewer").rglob("*") if path.suffix in (".js", ".ts", ".html", ".css")
)
NEVER = r"(?!)"  # a constraint that nothing meets
PLAIN_TILING = r"[A-Za-z][A-Za-z0-9_-]*(?<!-expansion)"  # an entry of `tilings`
CHOOSING = "|".join(map(paths.policy_pattern, POLICY_NAMES))  # policies, as a constraint

# A workflow that includes this one may have top-level keys of its own. It names them here, each with a function that gets
# the checked config and the key's value, and returns the config with what it adds.
EXTENSIONS = globals().get("EXTENSIONS", {})

try:
    # the keys of `--config` as Snakemake read them: numbers in lists and tables are text
    given = merge_tables(config, parse_command_line(dict(workflow.config_settings.config)))
    others = {key: given.pop(key, {}) for key in EXTENSIONS}
    given = check_config(add_scene_files(given, BASE / "config/scenes", quietly=True))
    for key, extend in EXTENSIONS.items():
        given = extend(given, others[key])
except InputError as error:
    raise WorkflowError(str(error)) from None
config.clear()
config.update(given)
config.update({table: NamedEntries(table, config[table]) for table in ("scenes", "presets", "tilings", "priors")})

# Presets whose photos another preset selects, and all other presets. An ending "-..." names a variant of a preset.
CHOOSERS = "|".join(name for name, preset in config["presets"].items() if not preset.get("choose_with")) or NEVER
FITS_ONCE = "|".join(name for name, preset in config["presets"].items() if preset.get("choose_with")) or NEVER
FITS_ONCE = rf"(?!(?:{CHOOSERS})/)(?:{FITS_ONCE})(?:-[^/]+)?"
FITS_ROUNDS = rf"(?!{FITS_ONCE}/){paths.NAME}"

# Runs whose last fit is of windows of the ground alone, by scene and preset: a constraint of the scene that looks ahead
WINDOWED_SCENES = "|".join(name for name in config["scenes"] if paths.fits_windows(config, name)) or NEVER
WINDOWED = rf"(?:{WINDOWED_SCENES})(?=/seed(?:{NATURAL})/{FITS_ONCE}/)"
NOT_WINDOWED = rf"(?!{WINDOWED}){paths.NAME}"


pathvars:
    **paths.TREE,


def constraints(config):
    """Every wildcard's constraint. Names of priors end where the path's next part begins."""
    terrain_priors = [name for name, prior in config["priors"].items() if prior["model"] == "terrain"]
    inpainters = "|".join(terrain_priors) or NEVER
    return paths.WILDCARDS | {
        "policy": f"{CHOOSING}|external(?=_none_pdrop0_lam0_k0/)",
        "prior": "|".join(["none(?=_pdrop0[_/])", *config["priors"]]),
        "inpainter": inpainters,
        "inpainted": rf"(?:/inpainted_(?:{inpainters}))?",
        "sweep": paths.NAME,
        "size": POSITIVE,
    }
