"""Shared by all stages: the checked config, the result tree, one spelling a number, and what the targets are."""

import re
from hashlib import sha256
from pathlib import Path

import dav_gswt
from dav_gswt.active.names import AT_ZERO, GEOMETRIC, IMAGINING, ORACLES
from dav_gswt.config import FLOOR, REFINED, check
from dav_gswt.errors import InputError
from dav_gswt.seams import draws
from dav_gswt.spelling import read_stop, spell, spell_completed, spell_stop
from dav_gswt.tradeoff import settings

LIBRARY = Path(dav_gswt.__file__).parent
BUNDLE_SCHEMA = str(Path(workflow.basedir, "workflow/schemas/davgswt.schema.json"))
VIEWER = sorted(str(p) for p in Path(workflow.basedir, "workflow/viewer").iterdir())

try:
    check(config, Path(workflow.basedir) / "workflow/schemas/config.schema.yaml")
    config.update(draws.entries(settings.entries(config)))
except InputError as error:
    raise WorkflowError(str(error)) from None


# One directory level a stage, naming only the parameters that the stage adds: a path is exactly what its file depends
# on, so two cells of a sweep that agree on the first stages meet in the same directories.
pathvars:
    logs="results/logs",
    benchmarks="results/benchmarks",
    photos="{scene}/photos",
    start="{scene}/seed{seed}",
    fit="{scene}/seed{seed}/{quality}",
    coarse="<fit>/coarse",
    scored="<coarse>/scores_{prior}_pdrop{p_drop}",
    active="<fit>/active_{policy}_{prior}_pdrop{p_drop}_lam{lam}_k{k}{stop}",
    round="<active>/iter{t}",
    levels="<round>{completed}/levels",
    tiles="<round>{completed}/tiles_{seam}",
    bundle="<tiles>/bundle_tau{tau}",
    terrain="<bundle>/terrain",
    seams="<bundle>/seams",


NAME = r"(?!(?:logs|benchmarks|snapshots|weights|prior|sweeps|tables|figures|tradeoff|stability|perceptual)(?:/|$))[a-z][a-z0-9_-]*"
NATURAL = r"0|[1-9]\d*"
POSITIVE = r"[1-9]\d*"
FRACTION = r"0|1|0\.\d*[1-9]"
SHARE = r"0|0\.\d*[1-9]"
NUMBER = r"0|[1-9]\d*|(?:0|[1-9]\d*)\.\d*[1-9]"
STOP = rf"(?:_upto{POSITIVE})?(?:_worth(?!0/)(?:{NUMBER}))?"  # or nothing
NEVER = r"(?!)"  # a constraint that nothing meets
# What reads no prior has one spelling of it: the names look at what follows them in a path.
PRIOR = "|".join(["none(?=_pdrop0[_/])", *config["priors"]])
PAINTER = "|".join(name for name, prior in config["priors"].items() if prior["model"] == "terrain") or NEVER
COMPLETED = rf"(?:/completed_(?:{PAINTER}))?"  # or nothing
CUT = rf"{NAME}(?<!{REFINED})"  # an entry of `seams`; with the ending its tiles are those of the entry, refined


def way(policy):
    """A constraint: the policy, followed by a spelling that it has of prior, p_drop and lam."""
    if policy in GEOMETRIC:
        return f"{policy}(?=_none_pdrop0_lam0_)"
    p_drop, lam = ("0" if key in AT_ZERO.get(policy, ()) else "[^_]+" for key in ("p_drop", "lam"))
    return f"{policy}(?!_none_)(?=_[a-z0-9_-]+_pdrop{p_drop}_lam{lam}_)"


CHOOSING = "|".join(way(policy) for policy in (*GEOMETRIC, *IMAGINING))  # of poses, by their scores
POLICY = f"{CHOOSING}|given(?=_none_pdrop0_lam0_k0/)"
COMPARING = {"study", "tradeoff", "seams", "stability", "view_benchmark"}  # targets that compare by LPIPS
SNAPSHOTS = "results/snapshots"  # of fits that run: outside the outputs, so that a killed fit can go on


def integer(wildcard):
    """A params function: the value of a wildcard, as an int."""
    return lambda wildcards: int(wildcards[wildcard])


def real(wildcard):
    """A params function: the value of a wildcard, as a float."""
    return lambda wildcards: float(wildcards[wildcard])


def entry(table, wildcard):
    """A params function: the config's entry of a table that a wildcard names."""
    return lambda wildcards: config[table][wildcards[wildcard]]


def growing(need):
    """A resources function: so much at the first attempt, twice as much at the second, and so on; 2000, or "60m".

    A job that ran out of memory or time and is tried again (`retries` of a profile) would else run out of it again.
    """
    amount, unit = re.fullmatch(r"(\d+)([mh]?)", str(need)).groups()
    return lambda wildcards, attempt: f"{int(amount) * attempt}{unit}" if unit else int(amount) * attempt


def source_of(*places):
    """Digest of library modules and packages, for params: Snakemake follows a rule's script, not its imports.

    What all stages share (cameras, fields, images, views) is always part of it.
    """
    files = []
    for place in ("cameras", "field", "images", "views", *places):
        found = LIBRARY / place
        files += sorted(found.rglob("*.[pch]*")) if found.is_dir() else [found.with_suffix(".py")]
    files = [f for f in files if "__pycache__" not in f.parts]
    return sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:12]


def scenes_of(kind):
    """A constraint: the names of the config's scenes of a kind."""
    return "|".join(n for n, s in config["scenes"].items() if s["kind"] == kind) or NEVER


def scenes_by(*agents):
    """A constraint: the names of the config's scenes that these agents photograph."""
    return "|".join(n for n, s in config["scenes"].items() if s.get("agent") in agents) or NEVER


def values_of(scene, policy=None, over=None):
    """The wildcards of what is made of a scene at the config's parameters, or at those that are laid over them."""
    asked = config | (over or {})
    given, policy = config["scenes"][scene]["kind"] == "field", policy or asked["policy"]
    told = {key: "0" if key in AT_ZERO.get(policy, ()) else spell(asked[key]) for key in ("p_drop", "lam")}
    if given or policy not in IMAGINING:
        told = {"p_drop": "0", "lam": "0"}
    return dict(
        scene=scene,
        seed=config["seeds"],
        quality=asked.get("quality", config["scenes"][scene]["quality"]),
        policy="given" if given else policy,
        prior="none" if given or policy not in IMAGINING else asked["prior"],
        **told,
        k=0 if given else asked["k"],
        stop="" if given else spell_stop(config["stop"]),
        t=0 if given else asked["rounds"],
        painter=config["prior"],
        completed="" if given else spell_completed(config["complete"], config["prior"]),
        seam=asked.get("seam", config["scenes"][scene]["seam"]),
        tau=spell(asked["tau"]),
    )


def terrain_of(scene):
    """A scene's terrain: page, stills, these small and, where the config asks for one, a flight."""
    made = [rules.make_page.output.page, *rules.render_terrain.output.stills, rules.show_stills.output.sheet]
    return expand(made + [rules.render_flight.output.frames] * bool(config["flight"]), **values_of(scene))


def study_of(scene):
    """What is known of the photos and of each round: how well it shows those that test, what the last is unsure of."""
    if config["scenes"][scene]["kind"] == "field":
        return []
    values = values_of(scene)
    rounds = [rules.evaluate_round.output.metrics] * bool(config["rounds"])
    scored = rules.score_round.output if config["rounds"] else rules.score_coarse.output
    completed = [rules.evaluate_completed.output.metrics] * config["complete"]
    return (
        expand(rules.report_photos.output.page, scene=scene)
        + expand(rules.evaluate_coarse.output.metrics, **values)
        + expand(rounds, **(values | {"t": range(1, config["rounds"] + 1)}))
        + expand(list(scored), **values)
        + expand(completed, **values)
    )


def folder_of(scene):
    """A scene's photos, as inputs: a photo that comes or goes is noticed."""
    folder = Path(config["scenes"][scene]["folder"])
    if not folder.is_dir():
        raise WorkflowError(f"config: scenes.{scene}.folder: there is no folder {folder}")
    return sorted(str(p) for p in folder.iterdir() if p.is_file() and not p.name.startswith("."))


def height_map(wildcards):
    """The image that the terrain's surface is read from, where the config names one."""
    path = config["heights"].get("file")
    if path and not Path(path).is_file():
        raise WorkflowError(f"config: heights.file: there is no file {path}")
    return {"map": path} if path else {}


def beside_photos(wildcards):
    """What a scene's entry names beside its photos: masks, a model of another program."""
    given = {key: config["scenes"][wildcards.scene].get(key) for key in ("masks", "model")}
    for key, path in given.items():
        if path and not Path(path).exists():
            raise WorkflowError(f"config: scenes.{wildcards.scene}.{key}: there is no {path}")
    return {key: path for key, path in given.items() if path}


def file_of(scene):
    """A scene's finished field, as an input."""
    file = Path(config["scenes"][scene]["field"])
    if not file.is_file():
        raise WorkflowError(f"config: scenes.{scene}.field: there is no file {file}")
    return str(file)


def before_round(wildcards):
    """What round t starts from: the coarse field and its scores, then those of round t - 1."""
    last = f"<results>/<active>/iter{int(wildcards.t) - 1}"
    if wildcards.t == "1":
        last = "<results>/<coarse>"
    scores = "<results>/<scored>" if wildcards.t == "1" else last
    return {
        "field": f"{last}/field.ply",
        "ground": f"{last}/ground.exr",
        "scores": f"{scores}/scores.csv",
        "maps": f"{scores}/maps.npz",
    }


def prior_of(wildcards):
    """What the scoring of poses reads beside the field: the weights of the prior, those of LPIPS."""
    if wildcards.prior == "none":
        return {}
    entry = config["priors"][wildcards.prior]
    files = {"lpips": rules.fetch_lpips.output.weights} if entry.get("lpips", True) else {}
    if entry["model"] == "terrain":
        files["weights"] = entry.get("weights", str(LIBRARY / "prior/terrain.safetensors"))
    for key in ("weights", "folder"):
        if key in entry and not Path(entry[key]).exists():
            raise WorkflowError(f"config: priors.{wildcards.prior}.{key}: there is no {entry[key]}; see docs/prior.md")
    return files


def painter_of(wildcards):
    """The weights of the prior that paints what no photo saw."""
    return {"weights": weights_of(wildcards.painter)}


def refiner_of(wildcards):
    """The weights of the prior that repairs cuts."""
    return {"weights": weights_of(refining(wildcards)["prior"])}


def weights_of(prior):
    """The file of weights of an entry of `priors` of model terrain."""
    weights = config["priors"][prior].get("weights", str(LIBRARY / "prior/terrain.safetensors"))
    if not Path(weights).exists():
        raise WorkflowError(f"config: priors.{prior}.weights: there is no {weights}; see docs/prior.md")
    return weights


def cutting(wildcards):
    """A params function: how tiles are cut. How they are refined is no part of it: all refinements share the cut."""
    entry = config["seams"][wildcards.seam.removesuffix(REFINED)]
    return {key: value for key, value in entry.items() if key != "refine"}


def refining(wildcards):
    """A params function: how the tiles of an entry of `seams` are refined."""
    entry = config["seams"].get(wildcards.seam, {})
    if "refine" not in entry:
        raise WorkflowError(
            f"config: seams.{wildcards.seam}.refine: is missing; it says how {wildcards.seam}{REFINED} is made"
        )
    return entry["refine"]


def lpips_if_fetched(wildcards):
    """LPIPS's weights for what measures with them where they are, and says where they are not; they are fetched first
    for the targets that are made to compare.
    """
    path = Path(rules.fetch_lpips.output.weights)
    return {"lpips": str(path)} if path.is_file() or COMPARING & set(workflow.dag_settings.targets) else {}


def describing(wildcards):
    """What tells cuts what the ground is, beside its colours: AlexNet where it was fetched, a segmenter in a folder."""
    seam = config["seams"][wildcards.seam.removesuffix(REFINED)]
    if seam.get("energy") == "colour":
        return {}
    if "sam2" not in seam:
        return lpips_if_fetched(wildcards)
    weights = Path(seam["sam2"], "model.safetensors")
    if not weights.is_file():
        raise WorkflowError(f"config: seams.{wildcards.seam}.sam2: there is no {weights}; see config/README.md")
    return lpips_if_fetched(wildcards) | {"sam2": str(weights)}


def regressors_of(wildcards):
    """Networks without diffusion, to compare the project's own prior with."""
    entry = config["priors"].get(wildcards.prior, {})
    count = config["calibration"]["regressors"] if entry.get("model") == "terrain" else 0
    files = expand("<results>/prior/regressor{member}.safetensors", member=range(count))
    return {"regressors": files} if files else {}


def truth_of(wildcards):
    """What candidates truly show, where it is drawn; a replayed scene has its photos."""
    if config["scenes"][wildcards.scene].get("agent") != "render":
        return {}
    return {"truth": "<results>/<photos>/candidates"}


def truth_for_oracle(wildcards):
    """For the policies that see the truth, where there is one."""
    if wildcards.policy not in ORACLES:
        return {}
    agent = config["scenes"][wildcards.scene].get("agent")
    if agent not in ("render", "replay"):
        raise WorkflowError(
            f"policy {wildcards.policy}: what {wildcards.scene} truly shows is not known; it needs agent: render or replay"
        )
    return truth_of(wildcards) if agent == "render" else {"images": "<results>/<photos>/images"}


def maps_of_round(wildcards):
    """The maps of the scoring that followed a round, where a prior was asked: else the field says itself what is known."""
    if wildcards.prior == "none":
        return {}
    return {"maps": f"<results>/{'<scored>' if wildcards.t == '0' else '<round>'}/maps.npz"}


def decided_before(wildcards):
    """What the rounds 1 to t - 1 told about their photos, and whether the last of them still asked for any."""
    rounds = [f"<results>/<active>/iter{t}" for t in range(1, int(wildcards.t))]
    last = {"last": f"{rounds[-1]}/poses.json"} if rounds else {}
    return fits_before(wildcards) | last


def fits_before(wildcards):
    """The reports of the updates of rounds 1 to t - 1."""
    return {"fits": [f"<results>/<active>/iter{t}/fit.json" for t in range(1, int(wildcards.t))]}


def captures_before(wildcards):
    """The photos that rounds 1 to t - 1 took."""
    return [f"<results>/<active>/iter{t}/capture" for t in range(1, int(wildcards.t))]


def captures_until(wildcards):
    """The photos that rounds 1 to t took."""
    return [f"<results>/<active>/iter{t}/capture" for t in range(1, int(wildcards.t) + 1)]


def photos_behind(wildcards):
    """All photos that a round's field was made of: those of the start, and captured ones; or the finished field."""
    if config["scenes"][wildcards.scene]["kind"] == "field":
        return {"photos": "<results>/<photos>/field.ply"}
    return {"photos": ["<results>/<photos>/images", *captures_until(wildcards)]}


def scores_that_chose(wildcards):
    """The scores that rounds 1 to t chose by: each one's are those that the round before left."""
    after = [f"<results>/<active>/iter{t}/scores.csv" for t in range(1, int(wildcards.t))]
    return ["<results>/<scored>/scores.csv", *after]


def poses_until(wildcards):
    """The poses that rounds 1 to t chose."""
    return [f"<results>/<active>/iter{t}/poses.json" for t in range(1, int(wildcards.t) + 1)]


def shown_rounds(wildcards):
    """The rounds of the figure of a cell's evolution: none, the first, and round t."""
    return sorted({0, 1, int(wildcards.t)})


def left_by(file, wildcards):
    """A file as each of the shown rounds left it; round 0 is the coarse field."""
    homes = [f"<active>/iter{t}" if t else "<coarse>" for t in shown_rounds(wildcards)]
    return [f"<results>/{home}/{file}" for home in homes]
