"""Level weights and cross-faded opacities: hand-worked values, the numbers shared with the page."""

import json
from pathlib import Path

import numpy as np
import pytest
from dav_gswt.terrain.weights import crossfade_opacity, finer_share, level_weights

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "weights.json").read_text())
FAR = np.array([0.0, 1e-9, 5.0, 9.0, 9.5, 10.0, 10.5, 11.0, 20.0, 1e12, np.inf])


def test_weights_are_those_shared_with_the_page():
    for entry in GOLDEN["levels"]:
        switches = [np.inf if s is None else s for s in entry["switches"]]
        found = level_weights(np.array([entry["distance"]]), switches, entry["bands"], entry["smooth"])[:, 0]
        np.testing.assert_allclose(found, entry["weights"], rtol=0, atol=1e-12, err_msg=str(entry))


def test_opacities_are_those_shared_with_the_page():
    opacity, weight, drawn = (np.array([e[key] for e in GOLDEN["opacities"]]) for key in ("opacity", "weight", "drawn"))
    np.testing.assert_allclose(crossfade_opacity(opacity, weight), drawn, rtol=1e-12, atol=0)


def test_the_band_is_worked_by_hand():
    distance = np.array([8.0, 9.0, 9.5, 10.0, 10.5, 11.0, 12.0])
    assert finer_share(distance, 10.0, 1.0).tolist() == [1, 1, 0.75, 0.5, 0.25, 0, 0]
    assert finer_share(distance, 10.0, 1.0, True).tolist() == [1, 1, 0.84375, 0.5, 0.15625, 0, 0]
    assert finer_share(distance, 10.0, 0.0).tolist() == [1, 1, 1, 0.5, 0, 0, 0]


@pytest.mark.parametrize("band, smooth", [(0.0, False), (1e-12, True), (1e-300, False), (1e6, True)])
def test_the_share_is_finite_and_falls_from_one_to_zero(band, smooth):
    share = finer_share(FAR, 10.0, band, smooth)
    assert np.isfinite(share).all() and (np.diff(share) <= 0).all() and share[-1] == 0
    assert (share[0] == 1) == (band < 10) and share[FAR == 10.0] == 0.5
