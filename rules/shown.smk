"""What the study's tables and figures are made from: sweeps, fields, bundles and pictures, by their paths."""

from dav_gswt.tables.asked import sweeps_of

TABLES = ("timing", "lod", "sensitivity", "ablation")
FRAMES = "results/tables/viewer.csv"


def viewer_if_measured(wildcards):
    """What a browser measured of bundles, where that was done; else these columns stay empty."""
    return {"viewer": FRAMES} if Path(FRAMES).is_file() else {}


def walked_over(wildcards):
    """A params function: what of the config's `frames` a walk is measured by, whichever the scene."""
    return {key: config["frames"][key] for key in ("heights", "flight", "width", "height", "budgets")}


def swept(table):
    """An input function: the sweeps that one of the study's tables is made from."""
    return lambda wildcards: [f"results/sweeps/{name}.csv" for name in config["study"][table]]


def setting_of(sweep):
    """What a sweep varies."""
    return next(iter(config["sweeps"][sweep]["vary"]))


def default_of(sweep):
    """The value that a setting has where it is not varied, as tables spell it."""
    return str(config.get(setting_of(sweep), ""))


def shown_estimator(scene, policy):
    """The wildcards of what the study's figures show of a scene after a policy chose."""
    asked = config["study"]["figures"]
    return chosen_values(scene, {"policy": policy, "rounds": asked["rounds"]}) | {"seed": asked["seed"]}


def of_estimators(output):
    """An input function: a file of each estimator that the study's figure shows."""
    return lambda wildcards: [
        expand(output, **shown_estimator(wildcards.scene, policy))[0]
        for policy in config["study"]["figures"]["estimators"]
    ]


def study_figures():
    """The paper's figures: the path of each, by its name in docs/figures; they are of scenes, seed and policy of `study`."""
    asked, found = config["study"]["figures"], {}
    for scene in asked["scenes"]:
        values = shown_estimator(scene, asked["policy"])
        shown = {
            "sphere": rules.plot_sphere.output.plot,
            "evolution": rules.plot_evolution.output.plot,
            "estimators": rules.plot_estimators.output.plot,
            "cuts": rules.show_cuts.output.plot,
            "doubt": rules.plot_doubt.output.plot,
        }
        found |= {f"{name}_{scene}": expand(path, **values)[0] for name, path in shown.items()}
    return found | {"budget": "results/sweeps/budget.png"}


def shown_terrains():
    """The stills of the terrain of each scene that the study's figures show."""
    asked = config["study"]["figures"]
    return [
        path
        for scene in asked["scenes"]
        for path in expand(rules.show_stills.output.sheet, **shown_estimator(scene, asked["policy"]))
    ]


def kept_as(name):
    """The ending of a figure of the study in docs/figures: those of photos are a fifth as large as JPEGs."""
    return ".jpg" if name.startswith(("evolution", "estimators", "cuts")) else ".png"


def captions():
    """What the figures of the study show, in their order."""
    about = {
        "sphere": "candidates by what scores said of them, and what was chosen",
        "evolution": "two test views after the first rounds",
        "estimators": "test views after as many photos, chosen by each estimator",
        "cuts": "cuts by colours and by what the ground is",
        "doubt": "uncertainty of tiles, and a walk over them",
    }
    return [
        f"{name.partition('_')[2]}: {about[name.partition('_')[0]]}" if "_" in name else "quality against photos"
        for name in study_figures()
    ]
