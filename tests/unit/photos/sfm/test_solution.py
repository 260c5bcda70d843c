"""In which ways photos are mapped, and which model is taken."""

from pathlib import Path

import numpy as np
import pycolmap
import pytest
from fixtures import photos as synth

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import FocalLength, SfmSign, SfmVerdict
from dav_gswt.photos.colmap_model import select_points, write_colmap_model
from dav_gswt.photos.sfm import mapping
from dav_gswt.photos.sfm.mapping import Approach, SfmPhoto, SfmScene, SfmSolution


def verdict(grade: str, *names: str) -> SfmVerdict:
    return SfmVerdict(grade, tuple(SfmSign(name, grade, f"{name} is odd") for name in names))


class Placed(pycolmap.Reconstruction):
    """A model of which only the number of its images is known; they are the first ones."""

    def __init__(self, count: int):
        super().__init__()
        self.count = count

    def num_reg_images(self) -> int:
        return self.count

    def reg_image_ids(self) -> list[int]:
        return list(range(1, self.count + 1))


@pytest.fixture
def solutions(monkeypatch):
    """Ways of mapping that give what a test says, and no others; the ways that were asked for."""
    asked = []

    def give(*verdicts, placed=(8, 8, 8), unsure=0):
        def solve(approach, scene, seed):
            asked.append(approach)
            if verdicts[len(asked) - 1] is None:
                raise InputError(f"way {len(asked)} places nothing")
            focal = FocalLength(300.0, 330.0, 330.0, 30.0, "freed")
            return SfmSolution(Placed(placed[len(asked) - 1]), (), focal, verdicts[len(asked) - 1], unsure)

        monkeypatch.setattr(mapping, "_solve", solve)
        scene = SfmScene("folder", [], {1: 300.0}, {}, Path("database.db"))
        return mapping.find_solution(scene, 0), asked

    return give


def test_the_best_of_several_ways_is_taken_and_all_are_named(solutions):
    found, asked = solutions(verdict("refused", "tilt", "GPS"), verdict("good"), verdict("doubtful", "tilt"))
    assert asked[1:] == [Approach("incremental", hold_focal=True), Approach("global", hold_focal=True)]
    assert found.verdict.grade == "good" and len(found.verdict.tried) == 3
    assert found.verdict.tried[0] == "incremental mapping: refused (tilt is odd; GPS is odd)"


def test_photos_without_a_place_are_named_with_what_they_share():
    photos = [SfmPhoto(Path(f"{i}.jpg"), f"{i}.png", (4, 3), 4, 3, None) for i in range(5)]
    pairs = [(0, 1, 90), (0, 2, 40), (2, 1, 50), (2, 3, 70), (4, 0, 1)]
    (two, three, four), unsure = mapping.explain_left_out(photos, {0, 1}, pairs)
    assert unsure == 1
    assert two[0] == "2.jpg" and "shares 50 points" in two[1]
    assert three[0] == "3.jpg" and "matches no photo" in three[1] and "shares 1 points" in four[1]


def test_photos_that_hang_on_the_others_by_a_few_points_lose_their_place(tmp_path):
    rng = np.random.default_rng(1)
    whole = synth.model(synth.flight(3, 4), synth.plain(800, 0.9, rng, relief=0.02))
    for ties, lost in ((7, {8: 7, 9: 7, 10: 7, 11: 7}), (60, {})):
        loose = synth.loosen(whole, 4, ties)
        write_colmap_model(select_points(loose, np.bincount(loose.point_of, minlength=800) >= 2), tmp_path)
        best = pycolmap.Reconstruction(str(tmp_path))
        assert mapping.remove_loose_photos(best) == lost
        assert best.num_reg_images() == 12 - len(lost)
        assert min(point.track.length() for point in best.points3D.values()) >= 2
    photos = [SfmPhoto(Path(f"{i}.jpg"), f"{i}.png", (4, 3), 4, 3, None) for i in range(3)]
    ((name, reason),), _ = mapping.explain_left_out(photos, {0, 1}, [(0, 1, 90), (0, 2, 40)], {2: 7})
    assert name == "2.jpg" and reason.startswith("only 7 points tie it to the other photos")
