"""Whether the config's `study` asks for sweeps, baselines and scenes that are there; loads no numerics."""

from dav_gswt.errors import InputError
from dav_gswt_study.sweeps.grid import name_value


def sweeps_of(study: dict) -> list[str]:
    """The sweeps that a study's tables are made from, each once."""
    named = [study["timing"], *study["sensitivity"], *study["ablation"], *study["also"]]
    return list(dict.fromkeys(named))


def check(config: dict) -> None:
    """Raises: InputError: a sweep, a baseline or a scene of `study` that is not there, and what is."""
    if "tables" not in config:
        return
    study, sweeps = config["tables"], config.get("sweeps", {})
    for name in sweeps_of(study):
        if name not in sweeps:
            raise InputError(
                f"config: study.tables: there is no sweep {name!r}; sweeps has {', '.join(sweeps) or 'nothing'}"
            )
    for name in study["ablation"]:
        values = [str(name_value(value)) for value in next(iter(sweeps[name]["vary"].values()))]
        if sweeps[name].get("baseline") not in values:
            raise InputError(
                f"config: study.sweeps.{name}.baseline: must be one of {', '.join(values)}, for study.tables.ablation"
            )
    for name in study["figures"]["scenes"]:
        if config["scenes"].get(name, {"kind": "field"})["kind"] == "field":
            raise InputError(f"config: study.tables.figures.scenes: {name} is no scene with photos")
