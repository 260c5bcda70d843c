import json

import numpy as np

from dav_gswt import cameras
from dav_gswt.active import capture
from dav_gswt.active.poses import Pose


def test_replay_takes_the_nearest_unseen_frame_once(tmp_path):
    (tmp_path / "images").mkdir()
    pool = {f"{x}.png": cameras.pinhole([x, 0, 5.0], [x, 0, 0], 8, 8, 40.0) for x in (0, 1, 2)}
    for name in pool:
        (tmp_path / "images" / name).write_text(name)
    asked = [(Pose(f"a{i}", 90.0, 0.0, 5.0), cameras.pinhole([0.9, 0, 5.0], [0.9, 0, 0], 8, 8, 40.0)) for i in range(4)]
    out = tmp_path / "capture"
    out.mkdir()
    shots = capture.replay(tmp_path, pool, asked, out, unit=5.0)
    assert [name for name, _, _ in shots] == ["1.png", "0.png", "2.png"]
    np.testing.assert_allclose([apart for _, _, apart in shots], [0.1 / 5, 0.9 / 5, 1.1 / 5], atol=1e-6)
    capture.write(out, "replay", asked, shots)
    record = json.loads((out / "capture.json").read_text())
    assert [s["name"] for s in record["shots"]] == ["1.png", "0.png", "2.png"]
    assert (out / "1.png").read_text() == "1.png"
