"""Figures that pages quote are those of the tables: each sentence is made from its table and looked for."""

from pathlib import Path

import numpy as np
import pytest

from dav_gswt.study import csv_tables

ROOT = Path(__file__).resolve().parents[3]
VIEWS, README, PHOTOS, SETTINGS = "docs/active-views.md", "README.md", "docs/photos.md", "docs/settings.md"
PRIOR, FRAMES = "docs/research/results/prior.md", "docs/research/results/frame-times.md"
FAMILIES = "desert", "meadow", "flowers", "grass", "planet"
GROUPS = {
    "orbit": ("oasis_orbit", "desert_orbit"),
    "free": ("oasis_free", "oasis_1_free", "desert_free"),
    "path": ("oasis_walk", "oasis_corridor"),
}


def read_rows(table: str, **where: str) -> list[dict]:
    """The rows of a table with these values in their columns."""
    read = csv_tables.read_table(ROOT / f"docs/research/data/{table}.csv")
    rows = [row for row in read if all(row[key] == value for key, value in where.items())]
    assert rows, f"{table}.csv has no row with {where}"
    return rows


def mean_of(rows: list[dict], column: str) -> float:
    return float(np.mean([float(row[column]) for row in rows]))


def short(value: float, places: int = 2) -> str:
    """A number without the zero before its point, as pages write it."""
    return f"{value:.{places}f}".replace("0.", ".", 1) if abs(value) < 1 else f"{value:.{places}f}"


def signed(value: float, places: int = 2) -> str:
    return ("+" if value >= 0 else "-") + short(abs(value), places)


def gain(measure: str, *scenes: str, policy: str = "coverage-error") -> float:
    """How much a policy gains over spreading, dB: the mean over scenes."""
    return mean_of(
        [row for scene in scenes for row in read_rows("view_comparison", measure=measure, policy=policy, scene=scene)],
        "mean",
    )


def interval(policy: str) -> str:
    (row,) = read_rows("view_comparison", measure="psnr", policy=policy, scene="copr_dunes_views")
    return f"{short(-float(row['high']))} to {short(-float(row['low']))}"


def quote_presets() -> list[str]:
    """The README's table of presets."""
    columns = {"seconds": "{:.0f}", "psnr": "{:.2f}", "lpips": "{:.3f}", "peak_mb": "{:.0f}", "bundle_mb": "{:.0f}"}
    rows = []
    for row in read_rows("preset_costs", scene="copr_dunes"):
        cells = [form.format(float(row[name])).removeprefix("0") for name, form in columns.items()]
        rows.append(f"| `{row['preset']}` | {' | '.join(cells)} |")
    return rows


def quote_gains() -> list[str]:
    """What the default gains over spreading, where poses are free, on an orbit and along a path; of given photos."""
    orbit, free, path = (GROUPS[name] for name in ("orbit", "free", "path"))
    return [
        f"gains {short(gain('psnr', *free))} dB",
        f"{short(gain('walker_psnr', *free))} dB at eye level",
        f"({signed(gain('psnr', *orbit))} and {signed(gain('psnr', *path))} dB) and better by "
        f"{short(gain('worst_psnr', *orbit))} and {short(gain('worst_psnr', *path))} dB in the worst tenth",
        f"{short(-gain('psnr', 'copr_dunes_views'))} dB on copr_dunes ({interval('coverage-error')}, five starts)",
        *quote_other_pools(),
        f"is {short(-gain('psnr', 'copr_dunes_views', policy='oracle'))} dB below ({interval('oracle')})",
        f"is {short(-gain('psnr', 'copr_dunes_views', policy='w2-lpips'))} dB below spreading",
        f"{short(-gain('worst_psnr', 'copr_dunes_views', policy='w2-lpips'))} dB below.",
    ]


def quote_other_pools() -> list[str]:
    """What the default of new photos loses or gains on other pools of given photos."""

    def less(table: str, scene: str) -> dict[str, float]:
        (row,) = read_rows(table, measure="psnr", policy="coverage-error", scene=scene)
        return {key: float(row[key]) for key in ("mean", "low", "high") if row[key]}

    hundred, pool = (less("hundred_comparison", scene)["mean"] for scene in ("desert_100", "desert_pool"))
    part = less("development_comparison", "caliterra_earthworks")
    whole = less("development_comparison", "caliterra_earthworks_pool")
    return [
        f"{short(-hundred)} on [a hundred photos](#at-the-papers-number-of-photos) and {short(-pool)} on 48 of desert",
        f"{short(-part['mean'])} on the exemplar of caliterra_earthworks "
        f"({short(-part['high'])} to {short(-part['low'])}, three starts",
        f"it gains {short(whole['mean'])} ({short(whole['low'])} to {short(whole['high'])})",
    ]


def quote_gains_in_readme() -> list[str]:
    free, orbit, path = (GROUPS[name] for name in ("free", "orbit", "path"))
    worst = [short(gain("worst_psnr", *scenes)) for scenes in (orbit, path)]
    return [
        f"[{short(gain('psnr', *free))} dB over spreading the photos]",
        f"the worst tenth of the views gains {worst[0]} and {worst[1]} dB",
    ]


def quote_hundred() -> list[str]:
    """The table of the loss under all photos of a pool."""

    def psnr(policy: str, photos: int) -> float:
        return mean_of(read_rows("hundred_curves", scene="desert_100", policy=policy, photos=str(photos)), "psnr")

    lost = {
        (policy, photos): short(psnr("all", 100) - psnr(policy, photos))
        for policy in ("farthest", "w2-lpips", "coverage-error")
        for photos in (28, 48, 68)
    }
    rows = [
        f"| {n} | {lost['farthest', n]} | {lost['w2-lpips', n]} | {lost['coverage-error', n]} |" for n in (28, 48, 68)
    ]
    pool = read_rows("hundred_benchmark", scene="desert_pool")
    gap = {row["policy"]: short(float(row["gap"])) for row in pool}
    return [*rows, f"end {gap['farthest']} dB under all 48, those by `coverage-error` {gap['coverage-error']}."]


def quote_refits() -> list[str]:
    """The table of refits: each way less the fit from scratch, the mean of two seeds."""

    def row(name: str, size: str, rate: str) -> str:
        mine = read_rows("refits_copr_dunes_pool", photos="24", photos_a_round=size, first_rate=rate)
        pairs = zip(mine, scratch, strict=True)
        apart = [float(one["psnr_colour_corrected"]) - float(two["psnr_colour_corrected"]) for one, two in pairs]
        change = signed(mean_of(mine, "lpips") - mean_of(scratch, "lpips"), 3)
        seeds = ", ".join(map(signed, apart))
        return f"| {name} | {signed(float(np.mean(apart)))} ({seeds}) | {change} | {mean_of(mine, 'seconds'):.0f} |"

    scratch = read_rows("refits_copr_dunes_pool", photos="24", photos_a_round="")
    ways = {"at once": "16", "by eights": "8", "by fours": "4", "by twos": "2"}
    return [row(f"{way}, rates as at first", size, "1") for way, size in ways.items()] + [
        row(f"{way}, rates from .3", size, "0.3") for way, size in ways.items()
    ]


def quote_true_gain() -> list[str]:
    """What choosing by the true gain reaches of two pools."""

    def end(scene: str, policy: str, photos: int, column: str) -> str:
        rows = read_rows(f"gain_bound_{scene}_pool", policy=policy, photos=str(photos))
        return f"{mean_of(rows, column):.2f}"

    columns = {"desert": "psnr", "copr_dunes": "psnr_colour_corrected"}
    quotes = []
    for scene, column in columns.items():
        gained, spread, error, random = (
            end(scene, policy, 20, column) for policy in ("gain", "farthest", "coverage-error", "random")
        )
        quotes.append(f"from {end(scene, '', 8, column)} to {gained} dB, photos far apart to {spread}, ")
        quotes += [f"by `coverage-error` to {error}", f"at random to {random}"]
    return quotes


def rank(score: str, scene: str, t: str) -> float:
    """Rank correlation of a score with the true error of a pose, in a round."""
    return mean_of([row for row in read_rows("calibration", score=score, round=t) if scene in row["scene"]], "spearman")


def average_rank(score: str, *scenes: str) -> float:
    return float(np.mean([rank(score, scene, t) for scene in scenes for t in ("0", "1")]))


def quote_calibration() -> list[str]:
    """How well the paper's u and coverage rank poses by their true error."""
    u, coverage = ((average_rank(score, *FAMILIES), average_rank(score, "copr")) for score in ("u", "coverage"))
    return [
        f"(rank correlation {short(u[0])} on average over five families, -{short(-u[1])} on copr_dunes)",
        f"({short(coverage[0])} and {short(coverage[1])};",
    ]


def quote_ranks() -> list[str]:
    """The rows of the table of scores, without its emphasis, and what it says of them."""
    named = {"coverage": "`coverage`", "low": "`low`", "far": "`far`", "opacity": "opacity"}
    named |= {"w2_sq": "`w2_sq`, p_drop 0.15", "u": "u = W2 + 0.1 LPIPS (the paper's)"}
    named |= {score: f"{score} (independent noise)" for score in ("spread", "residual")}
    rows = []
    for score, name in named.items():
        pairs = [f"{rank(score, scene, '0'):.2f}, {rank(score, scene, '1'):.2f}" for scene in (*FAMILIES, "copr")]
        rows.append(f"| {name} | {' | '.join(pairs)} |")
    means = {score: [average_rank(score, *FAMILIES), average_rank(score, "copr")] for score in named}
    return [
        *rows,
        "has {:.2f} on average over the five synthetic families and {:.2f} on".format(*means["coverage"]),
        "the residual has {:.2f} and {:.2f}, the spread {:.2f} and {:.2f}".format(*means["residual"], *means["spread"]),
    ]


def quote_shortcuts() -> list[str]:
    """PSNR of the page's shortcuts against exact sorting."""

    def psnr(scene: str, view: str, shortcut: str) -> str:
        return f"{mean_of(read_rows('presort', scene=scene, view=view, shortcut=shortcut), 'psnr'):.1f}"

    desert = [psnr("desert_pool", view, "all") for view in ("near", "walker")]
    ground, plants = (
        [psnr("copr_dunes_pool", view, shortcut) for view in ("near", "walker")]
        for shortcut in ("presorting", "objects")
    )
    return [
        f"on desert {desert[0]} dB from near and {desert[1]} at eye level",
        f"of the ground leave {ground[0]} and {ground[1]} dB",
        f"({plants[0]} and {plants[1]} dB)",
    ]


def quote_updates() -> list[str]:
    """The sentence on refits of desert: each way less the fit from scratch, the mean of two seeds."""

    def apart(size: str, rate: str, column: str) -> float:
        mine = read_rows("refits_desert_pool", photos="20", photos_a_round=size, first_rate=rate)
        return mean_of(mine, column) - mean_of(scratch, column)

    scratch, sizes = read_rows("refits_desert_pool", photos="20", photos_a_round=""), ("12", "8", "4", "2")
    low = [short(-apart(size, "0.3", "psnr_colour_corrected")) for size in sizes]
    full = [short(-apart(size, "1", "psnr_colour_corrected")) for size in sizes]
    change = [signed(apart(size, "1", "lpips"), 3) for size in sizes]
    return [
        f"from .3 end {low[0]} dB below (at once), {low[1]} (by eights), {low[2]} (by fours) and {low[3]} (by twos)",
        f"from full rates {', '.join(full[:3])} and {full[3]} dB below, with {', '.join(change[:3])} and {change[3]}",
    ]


def quote_worth_of_photos() -> list[str]:
    """What 16 photos that are spread out gain over 8, on copr_dunes."""
    rows = read_rows("view_curves", scene="copr_dunes_views", policy="farthest")
    ends = [mean_of([row for row in rows if row["photos"] == n], "psnr") for n in ("8", "16")]
    return [f"16 photos spread out instead of 8 are worth {ends[1] - ends[0]:.1f} dB"]


def quote_expected_gains() -> list[str]:
    """How far the expected gain of a round can be trusted."""
    (every,), (dunes,) = (read_rows("view_worth", scene=scene) for scene in ("every", "copr_dunes_views"))
    paths = [row for scene in GROUPS["path"] for row in read_rows("view_worth", scene=scene)]
    held = round(float(every["covered"]) * int(every["rounds"]))
    return [
        f"held the gain in {held} of {every['rounds']} rounds",
        f"{short(float(dunes['expected']))} dB a round were expected and {short(float(dunes['gained']))} gained",
        f"along a path ({short(mean_of(paths, 'expected'))} and {signed(mean_of(paths, 'gained'))})",
    ]


def quote_large_photos() -> list[str]:
    """How much longer a step of photos of 12 megapixels takes than one of `standard`."""
    (large,) = (row for row in read_rows("scale", kind="pixels") if float(row["megapixels"]) > 10)
    usual = mean_of(read_rows("scale", kind="photos"), "step_seconds")
    return [f"about {float(large['step_seconds']) / usual:.0f} times as long a step as `standard`"]


@pytest.mark.parametrize(
    ("page", "quote"),
    [
        (README, quote_presets),
        (README, quote_gains_in_readme),
        (VIEWS, quote_gains),
        (VIEWS, quote_hundred),
        (VIEWS, quote_refits),
        (VIEWS, quote_true_gain),
        (VIEWS, quote_calibration),
        (PRIOR, quote_ranks),
        (FRAMES, quote_shortcuts),
        (VIEWS, quote_updates),
        (VIEWS, quote_worth_of_photos),
        (SETTINGS, quote_expected_gains),
        (PHOTOS, quote_large_photos),
    ],
)
def test_a_page_quotes_what_its_table_has(page, quote):
    text = " ".join((ROOT / page).read_text(encoding="utf-8").replace("**", "").split())
    assert [sentence for sentence in quote() if sentence not in text] == []
