"""The page of seams: every number from a table, a row for what was measured and none for what was not."""

from pathlib import Path

from fixtures.markdown import collapse_spaces

from dav_gswt.study.seams import page, summary

OWN = {"desert": "semantic", "copr_dunes": "auto"}
NAMES = ("border", "cut", "ceiling")


def page_text(summary, ablation, repetition, own, pictures):
    template = Path(__file__).parents[4] / "workflow/report/seams.md"
    return collapse_spaces(page.format_seam_page(template, (summary, ablation, repetition), own, pictures))


def summary_row(scene, variant, view="every", share="0.25"):
    row = {
        "scene": scene,
        "seed": 0,
        "preset": "draft",
        "variant": variant,
        "view": view,
        "ground": view,
        "share": share,
    }
    for k, name in enumerate(NAMES):
        row |= {name: f"{0.001 * k}", f"{name}_low": f"{0.001 * k - 0.002}", f"{name}_high": f"{0.001 * k + 0.002}"}
    return row | {f"{name}_jump": "1.234" for name in (*NAMES, "floor")}


def less(variant, scene, measure, value):
    about = {"variant": variant, "baseline": "colour", "measure": measure, "scene": scene, "seed": 0}
    return about | {"difference": value, "difference_low": value and "-1", "difference_high": value and "1"}


def repeat(scene, variant, east, north, terrain, exemplar=""):
    return {"scene": scene, "variant": variant, "east": str(east), "north": str(north)} | {
        "terrain": terrain,
        "exemplar": exemplar,
    }


def line_of(text, begin):
    (found,) = [line for line in text.splitlines() if line.startswith(begin)]
    return found


def test_every_scene_is_told_with_its_own_seam_over_all_views():
    rows = [
        summary_row("desert", "semantic"),
        summary_row("desert", "colour"),
        summary_row("desert", "semantic", "near"),
        summary_row("moon", "none"),
    ]
    text = page_text(rows, [], [], OWN, {})
    line = line_of(text, "| desert | `semantic`")
    assert "+0.0000 (-0.0020, +0.0020) | +0.0010 (-0.0010, +0.0030)" in line and "| 25% | 1.23 |" in line
    assert "`colour`" not in text and "moon" not in text and "near |" not in text


def test_a_way_that_cannot_be_told_is_left_empty():
    assert "| +0.0020 (+0.0000, +0.0040) | | 1.23 |" in page_text(
        [summary_row("desert", "semantic", share="")], [], [], OWN, {}
    )


def test_ways_to_cut_stand_first_over_all_scenes():
    rows = [less("none", "desert", "psnr", "-0.5"), less("none", summary.EVERY, "psnr", "-0.25")]
    text = page_text([], [*rows, less("none", "desert", "jump", "")], [], OWN, {})
    assert "## Other ways to cut, minus `colour`" in text
    overall, desert = line_of(text, "| `none` | all"), line_of(text, "| `none` | desert")
    assert "-0.25 (-1.00, +1.00)" in overall and "-0.50" in desert and desert.endswith("| |")
    assert text.index(overall) < text.index(desert)


def test_repetition_is_told_of_scenes_that_were_measured():
    rows = [repeat("desert", "semantic", 1, 0, "0.0812", "0.01"), repeat("desert", "semantic", 0, 1, "0.09")]
    text = page_text([], [], [*rows, repeat("desert", "colour", 1, 0, "0.5")], OWN, {})
    assert "| desert | 0.081 (0.010) | 0.090 | | | |" in text and "0.500" not in text and "copr_dunes" not in text


def test_pictures_are_shown_with_their_captions():
    assert "![All of it](figures/all.png)" in page_text([], [], [], OWN, {"figures/all.png": "All of it"})
