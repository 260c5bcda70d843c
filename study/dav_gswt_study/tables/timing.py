"""The paper's table of timing: time of each stage, and of a frame of the viewer."""

from dav_gswt_study.tables import paper, spread

MEGA, MINUTE = 1e6, 60.0
FRAMES = ("render_ms", "sort_ms", "sort_share", "update_ms", "update_share")
PRINTED = ("splats_m", "recon_min", "cut_s", "presort_s", *FRAMES)


def tabulate_timing(cells: list[dict], families: dict[str, str]) -> list[dict]:
    """A row for each scene, means over its seeds.

    splats_m: Gaussians of all tiles and levels; recon_min: from photos with their cameras to the last round's field
    (taking photos not counted); cut_s: tiles; presort_s: the bundle with its orders. The viewer's columns are empty
    where it measured nothing; its shares are of frames in which the worker ran; the paper leaves open what its are of.
    Args: cells: of a sweep, those at one setting, with the viewer's; families: of synthetic scenes, as the paper's.
    """
    found, scenes = [], list[str](dict.fromkeys(row["scene"] for row in cells))
    for scene in scenes:
        mine = [row for row in cells if row["scene"] == scene]
        splats, recon, presort = (spread.mean_and_deviation(mine, key) for key in ("splats", "recon_s", "bundle_s"))
        row = {"scene": scene, "preset": mine[0]["preset"], "seeds": len(mine)}
        row |= {"photos": spread.compute_mean(mine, "photos")}
        row |= {"splats_m": _over(splats["splats"], MEGA), "recon_min": _over(recon["recon_s"], MINUTE)}
        row |= {"recon_min_sd": _over(recon["recon_s_sd"], MINUTE)} | spread.mean_and_deviation(mine, "levels_s")
        row |= spread.mean_and_deviation(mine, "cut_s")
        row |= {"presort_s": presort["bundle_s"], "presort_s_sd": presort["bundle_s_sd"]}
        row |= {key: spread.compute_mean(mine, key) for key in (*spread.VIEWER, "peak_mb")}
        found.append(row | paper.find_printed("timing", families.get(scene, scene), PRINTED))
    return found


def select_setting(cells: list[dict], value: str) -> list[dict]:
    """The cells of a sweep at a value of what it varies; at its first where it has not that one."""
    values = [row["varied_0"] for row in cells]
    return [row for row in cells if row["varied_0"] == (value if value in values else values[0])]


def _over(value: float | None, unit: float) -> float | None:
    return None if value is None else value / unit
