"""All formulas that are compared with float64, and the rows of numerics.md that hold none."""

from dav_gswt.stability import choosing, cutting, drawing, levels, likeness, scoring, stored

GROUPS = {
    "Scores of views": scoring.FORMULAS,
    "Choosing and judging": choosing.FORMULAS,
    "Pictures": likeness.FORMULAS,
    "Seams": cutting.FORMULAS,
    "Levels, surface, tiles": levels.FORMULAS,
    "Rasterizer": drawing.FORMULAS,
    "Storage and sums": stored.FORMULAS,
}
WITHOUT = {
    "Algorithm 1": "counts of photos: whole numbers, which the runs at k = pool try",
}  # rows of numerics.md's table without a formula, and why
