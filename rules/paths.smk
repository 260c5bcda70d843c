"""Shared by all stages: the checked config, the result tree (dav_gswt.paths), and what a scene's targets are."""

import re
from pathlib import Path

from dav_gswt import paths
from dav_gswt.code_digest import LIBRARY, digest_code
from dav_gswt.config.load import add_scene_files, check_config
from dav_gswt.errors import InputError
from dav_gswt.images.lpips_package import locate_weights
from dav_gswt.paths import INPAINTED, NATURAL, POSITIVE, SNAPSHOTS
from dav_gswt.views.policy_names import ORACLES, POLICY_NAMES
from dav_gswt.workflow import lift_job_rate_limit

BASE = Path(workflow.basedir)
BUNDLE_SCHEMA = str(BASE / "workflow/schemas/davgswt.schema.json")
VIEWER = sorted(str(path) for path in (BASE / "workflow/viewer").rglob("*") if path.suffix in (".js", ".html", ".css"))
NEVER = r"(?!)"  # a constraint that nothing meets
PLAIN_TILING = r"[a-z][a-z0-9_-]*(?<!-refined)(?<!-expansion)"  # an entry of `tilings`
CHOOSING = "|".join(map(paths.policy_pattern, POLICY_NAMES))  # policies, as a constraint

try:
    config.update(check_config(add_scene_files(config, BASE / "config/scenes")))
except InputError as error:
    raise WorkflowError(str(error)) from None


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
        "kind": "spz|sog",
        "size": POSITIVE,
    }


def integer(wildcard):
    """A params function: the value of a wildcard, as an int."""
    return lambda wildcards: int(wildcards[wildcard])


def real(wildcard):
    """A params function: the value of a wildcard, as a float."""
    return lambda wildcards: float(wildcards[wildcard])


def entry(table, wildcard):
    """A params function: the config's entry of a table that a wildcard names."""
    return lambda wildcards: config[table][wildcards[wildcard]]


def per_attempt(need):
    """A resources function: `need` at the first attempt, twice as much at the second; 2000, or "60m".

    A job that ran out of memory or time and is tried again (`retries` of a profile) would else run out of it again.
    """
    amount, unit = re.fullmatch(r"(\d+)([mh]?)", str(need)).groups()
    return lambda wildcards, attempt: f"{int(amount) * attempt}{unit}" if unit else int(amount) * attempt


def code_of(script):
    """A params function: a digest of the library code that a script runs."""
    return lambda wildcards: digest_code(BASE / f"scripts/{script}.py")


def scenes_of(*kinds):
    """A constraint: the config's scenes of these kinds."""
    return "|".join(name for name, scene in config["scenes"].items() if scene["kind"] in kinds) or NEVER


def scenes_by(*agents):
    """A constraint: the config's scenes that these agents photograph."""
    return "|".join(name for name, scene in config["scenes"].items() if scene.get("agent") in agents) or NEVER


def existing(path, where, hint=""):
    """A path that the config names: as it stands, or below the repository. Raises: WorkflowError: it is not there."""
    found = next((place for place in (Path(path), BASE / path) if place.exists()), None)
    if found is None:
        raise WorkflowError(f"config: {where}: there is no {path}{hint}")
    return str(found)


def files_in(folder):
    """The files of a folder, as inputs: one that is added or removed is noticed."""
    return sorted(str(path) for path in Path(folder).iterdir() if path.is_file() and not path.name.startswith("."))


def lpips_weights(wildcards=None):
    """LPIPS's weights as an input of what cuts, scores and measures with them; none where the config says so."""
    return {} if config["lpips"] == "none" else {"lpips": rules.convert_lpips_weights.output.weights}


def terrain_weights(prior):
    """The file of weights of an entry of `priors` of model terrain."""
    weights = config["priors"][prior].get("weights")
    return existing(weights, f"priors.{prior}.weights") if weights else str(LIBRARY / "prior/terrain.safetensors")


def round_folder(t):
    """The folder that round t left; round 0 is the coarse field."""
    return f"<results>/<active>/iter{t}" if t else "<results>/<coarse>"


def captures_until(wildcards):
    """The photos that rounds 1 to t took."""
    return [f"{round_folder(t)}/capture" for t in range(1, int(wildcards.t) + 1)]


def captures_before(wildcards):
    """The photos that rounds 1 to t - 1 took."""
    return captures_until(wildcards)[:-1]


def round_before(wildcards):
    """The field that round t starts from, and its scores."""
    t = int(wildcards.t) - 1
    scores = round_folder(t) if t else "<results>/<scored>"
    return {
        "field": f"{round_folder(t)}/field.ply",
        "ground": f"{round_folder(t)}/ground.exr",
        "scores": f"{scores}/scores.csv",
        "maps": f"{scores}/maps.npz",
    }


def branch(scene, policy=None, changes=None):
    """The wildcards of what is made of a scene, by the config or by settings that replace some of its own."""
    return paths.encode_branch(config, scene, policy, changes)


def terrain_targets(scene):
    """A scene's terrain: page, stills, a sheet of them and, where the config asks for one, a flight."""
    made = [rules.make_page.output.page, *rules.render_terrain.output.stills, rules.make_contact_sheet.output.sheet]
    return expand(made + [rules.render_flight.output.frames] * bool(config["flight"]), **branch(scene))


def photo_targets(scene):
    """The photo report, the metrics of each round, and the scores of the last."""
    if config["scenes"][scene]["kind"] == "field":
        return []
    values, rounds = branch(scene), config["rounds"]
    scored = rules.score_round.output if rounds else rules.score_coarse.output
    return (
        expand(rules.report_photos.output.page, scene=scene)
        + expand(rules.evaluate_coarse.output.metrics, **values)
        + expand([rules.evaluate_round.output.metrics] * bool(rounds), **(values | {"t": range(1, rounds + 1)}))
        + expand(list(scored), **values)
        + expand([rules.evaluate_inpainted.output.metrics] * config["inpaint"], **values)
    )
