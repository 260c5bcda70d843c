"""The values of the page study/report/scale.md."""

from dav_gswt_study.scale import growth


def describe(rows: list[dict], cells: list[dict], asked: dict, preset: dict) -> dict:
    """The values of the page's template. cells: with what they were made by; asked: the config's `study.scale`."""
    made = [cell["made"] for cell in cells]
    renderers = {", ".join(str(value) for value in each["renderer"].values()) for each in made}
    return {
        "version": " and ".join(sorted({each["version"] for each in made})),
        "renderer": " and ".join(sorted(renderers)),
        "processor": " and ".join(sorted({f"{each['cores']} cores of {each['processor']}" for each in made})),
        "scene": asked["scene"],
        "preset": asked["preset"],
        "size": asked["size"],
        "count": asked["photos_of_pixels"],
        "steps": asked["steps_of_pixels"],
        "limited": asked["pixels_of_limits"],
        "least": min(asked["photos"]),
        "most": preset["max_gaussians"],
        "steps_per_photo": preset["steps_per_photo"],
        "threads": growth.describe_threads(rows),
        "parallel": f"{100 * growth.find_parallel_share(rows):.0f}",
        "extrapolated": growth.extrapolate(rows, asked["size"]),
    } | {kind: growth.describe_kind(rows, kind) for kind in growth.KINDS}
