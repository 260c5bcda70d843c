import numpy as np
import pytest

from dav_gswt.images import image_files
from dav_gswt_study import figures


@pytest.mark.parametrize("ending", [".png", ".jpg"])
def test_a_picture_is_kept_as_its_ending_says(tmp_path, ending):
    picture = np.tile(np.linspace(0, 1, 64, dtype=np.float32)[:, None, None], (1, 48, 3))
    image_files.write_png(tmp_path / "a.png", picture)
    figures.copy_figure(tmp_path / "a.png", tmp_path / f"b{ending}")
    assert (tmp_path / f"b{ending}").read_bytes()[:3] == {".png": b"\x89PN", ".jpg": b"\xff\xd8\xff"}[ending]
    np.testing.assert_allclose(image_files.read_photo(tmp_path / f"b{ending}"), picture, atol=0.02)
