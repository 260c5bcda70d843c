"""The config of the study, checked."""

from fixtures.configs import ROOT

from dav_gswt.config.load import add_scene_files, check_config, read_config
from dav_gswt_study.config import expand_study


def read_tables(*more: str) -> tuple[dict, dict]:
    """The product's part of the config, checked, and the table `study`; more: files that are laid over them."""
    files = [ROOT / file for file in ("study/config.yaml", "config/config.yaml", *more)]
    given = add_scene_files(read_config(files), ROOT / "config/scenes")
    study = given.pop("study")
    return check_config(given), study


def study_config(*more: str) -> dict:
    """The config with the study's table and all entries that the study makes."""
    return expand_study(*read_tables(*more))


def flat_config() -> dict:
    """The config with the study's tables beside the product's, as the study's functions read it."""
    config, study = read_tables()
    study = expand_study(config, study)["study"]
    return config | study | {"study": study}


def check_flat(flat: dict) -> dict:
    """Check a config that `flat_config` gave and a test changed."""
    study = {key: flat[key] for key in flat["study"]}
    product = {key: value for key, value in flat.items() if key != "study" and key not in study}
    return expand_study(check_config(product), study)
