"""All formulas that are compared with float64, and the rows of docs/research/numerics.md that hold none."""

from dav_gswt.study.stability import cutting, image_metrics, levels, rendering, scoring, selection, stored

GROUPS = {
    "Scores of views": scoring.FORMULAS,
    "Choosing and judging": selection.FORMULAS,
    "Pictures": image_metrics.FORMULAS,
    "Seams": cutting.FORMULAS,
    "Levels, surface, tiles": levels.FORMULAS,
    "Rasterizer": rendering.FORMULAS,
    "Storage and sums": stored.FORMULAS,
}
WITHOUT = {
    "Algorithm 1": "counts of photos: whole numbers, which the runs at k = pool try",
}  # rows of its table without a formula, and why
