"""What the search says of its seams."""

import numpy as np
import pytest

from dav_gswt.study.expansion import compute_costs_along
from dav_gswt.tiles import build, layout
from dav_gswt.tiles.layout import CENTRE


@pytest.mark.parametrize("kind", ["colour", "semantic"])
def test_the_energy_of_a_tile_is_that_of_the_seam_around_its_centre(sample_ground, kind):
    """Priced again in the finished tile, edge by edge; they differ only where a strip's own seam meets the centre's."""
    pairs = []

    def price_again(problem, centre, labels, shift):
        own = labels.astype(int)
        cells = [problem.source_cells(np.full_like(own, label), shift) for label in range(len(layout.LABELS))]
        rows, columns = (np.stack(part) for part in zip(*cells, strict=True))
        total = 0.0
        for dy, dx in ((0, 1), (1, 0)):
            here, there = own[: len(own) - dy, : len(own) - dx], own[dy:, dx:]
            at = np.nonzero((here == CENTRE) != (there == CENTRE))
            ends = [(at[0], at[1]), (at[0] + dy, at[1] + dx)]
            a, b = here[at], there[at]
            tails, heads = (tuple((rows[label, *end], columns[label, *end]) for label in (a, b)) for end in ends)
            axis = np.full(len(a), dy)
            total += float(compute_costs_along(problem.energy.terms(centre.gamma), tails, heads, axis).sum())
        pairs.append((centre.seam.energy, total))
        return labels

    options = build.TilingOptions(share=0.5, strip=0.17, candidates=40, tries=2, kind=kind, relabel=price_again)
    rng = np.random.default_rng(2)
    build.cut_tiles(
        sample_ground.levels, sample_ground.exemplar, sample_ground.colour, np.zeros((96, 96)), options, rng
    )
    reported, own = np.array(pairs).T
    np.testing.assert_allclose(reported, own, rtol=0.02)
    assert reported.sum() == pytest.approx(own.sum(), rel=2e-3)
