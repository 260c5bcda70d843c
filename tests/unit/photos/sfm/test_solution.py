"""In which ways photos are mapped, and which model is taken."""

from pathlib import Path

import pycolmap
import pytest

from dav_gswt.errors import InputError
from dav_gswt.geometry.scene_frame import FocalLength, SfmSign, SfmVerdict
from dav_gswt.photos.sfm import solution
from dav_gswt.photos.sfm.mapping import Approach


def verdict(grade: str, *names: str) -> SfmVerdict:
    return SfmVerdict(grade, tuple(SfmSign(name, grade, f"{name} is odd") for name in names))


class Placed(pycolmap.Reconstruction):
    """A model of which only the number of its images is known."""

    def __init__(self, count: int):
        super().__init__()
        self.count = count

    def num_reg_images(self) -> int:
        return self.count


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
            return solution.SfmSolution(Placed(placed[len(asked) - 1]), (), focal, verdicts[len(asked) - 1], unsure)

        monkeypatch.setattr(solution, "_solve", solve)
        scene = solution.SfmScene("folder", [], {1: 300.0}, None, Path("database.db"))
        return solution.find_solution(scene, "incremental", 0), asked

    return give


def test_the_best_of_several_ways_is_taken_and_all_are_named(solutions):
    found, asked = solutions(verdict("refused", "tilt", "GPS"), verdict("good"), verdict("doubtful", "tilt"))
    assert asked[1:] == [Approach("incremental", hold_focal=True), Approach("global", hold_focal=True)]
    assert found.verdict.grade == "good" and len(found.verdict.tried) == 3
    assert found.verdict.tried[0] == "incremental mapping: refused (tilt is odd; GPS is odd)"


def test_a_model_of_few_photos_does_not_win(solutions):
    found, _ = solutions(verdict("doubtful", "tilt"), verdict("good"), verdict("refused", "tilt"), placed=(8, 3, 8))
    assert found.verdict.grade == "doubtful"


def test_of_equal_models_the_first_stays(solutions):
    found, _ = solutions(*[verdict("doubtful", "tilt")] * 3)
    assert found.verdict.tried[0].startswith("incremental mapping: doubtful")


def test_photos_left_out_though_they_match_are_tried_with_the_other_mapper(solutions):
    found, asked = solutions(verdict("good"), verdict("good"), placed=(14, 19), unsure=5)
    assert asked == [Approach("incremental"), Approach("global")] and found.best.num_reg_images() == 19


def test_the_other_mapper_does_not_win_with_a_worse_model(solutions):
    found, _ = solutions(verdict("good"), verdict("doubtful", "tilt"), placed=(14, 19), unsure=5)
    assert found.best.num_reg_images() == 14


def test_photos_left_out_alone_ask_for_no_other_way(solutions):
    assert len(solutions(verdict("doubtful", "placed", "groups"))[1]) == 1


def test_where_the_first_way_gives_no_model_others_are_tried(solutions, monkeypatch):
    monkeypatch.setattr(solution, "_read_pairs", lambda _: [(0, 1, 50)])
    found, asked = solutions(None, verdict("doubtful", "tilt"), verdict("good"))
    assert asked[1:] == [Approach("incremental", hold_focal=True), Approach("global", hold_focal=True)]
    assert found.verdict.grade == "good" and found.verdict.tried[0] == "incremental mapping: way 1 places nothing"


def test_the_first_reason_is_given_where_no_way_gives_a_model(solutions, monkeypatch):
    monkeypatch.setattr(solution, "_read_pairs", lambda _: [(0, 1, 50)])
    with pytest.raises(InputError, match="way 1 places nothing"):
        solutions(None, None, None)


def test_photos_none_of_which_match_are_mapped_once(solutions, monkeypatch):
    monkeypatch.setattr(solution, "_read_pairs", lambda _: [(0, 1, 12)])
    with pytest.raises(InputError, match="way 1 places nothing"):
        solutions(None)
