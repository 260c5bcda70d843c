"""The paper's table of timing: time of each stage, and of a frame of the viewer."""

from dav_gswt.study.tables import paper, spread

MEGA, MINUTE = 1e6, 60.0
FRAMES = ("render_ms", "sort_ms", "sort_share", "update_ms", "update_share")
PRINTED = ("splats_m", "recon_min", "cut_s", "presort_s", *FRAMES)


def rows(cells: list[dict], families: dict[str, str]) -> list[dict]:
    """A row for each scene, means over its seeds.

    splats_m: Gaussians of all tiles and levels; recon_min: from photos with their cameras to the last round's field
    (taking photos not counted); cut_s: tiles; presort_s: the bundle with its orders. The viewer's columns are empty
    where it measured nothing; its shares are of frames in which the worker ran; the paper leaves open what its are of.
    Args: cells: of a sweep, those at one setting, with the viewer's; families: of synthetic scenes, as the paper's.
    """
    found = []
    for scene in dict.fromkeys(row["scene"] for row in cells):
        mine = [row for row in cells if row["scene"] == scene]
        splats, recon, presort = (spread.both(mine, key) for key in ("splats", "recon_s", "bundle_s"))
        row = {"scene": scene, "preset": mine[0]["preset"], "seeds": len(mine), "photos": spread.mean(mine, "photos")}
        row |= {"splats_m": _over(splats["splats"], MEGA), "recon_min": _over(recon["recon_s"], MINUTE)}
        row |= {"recon_min_sd": _over(recon["recon_s_sd"], MINUTE)} | spread.both(mine, "levels_s")
        row |= spread.both(mine, "cut_s") | {"presort_s": presort["bundle_s"], "presort_s_sd": presort["bundle_s_sd"]}
        row |= {key: spread.mean(mine, key) for key in (*spread.VIEWER, "peak_mb")}
        found.append(row | paper.beside("timing", families.get(scene, scene), PRINTED))
    return found


def at_setting(cells: list[dict], value: str) -> list[dict]:
    """The cells of a sweep at a value of what it varies; at its first where it has not that one."""
    values = [row["varied_0"] for row in cells]
    return [row for row in cells if row["varied_0"] == (value if value in values else values[0])]


def _over(value: float | None, unit: float) -> float | None:
    return None if value is None else value / unit
