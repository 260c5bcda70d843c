from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made
from scipy.spatial.transform import Rotation

from dav_gswt import code_digest
from dav_gswt.field import concatenate_fields, rgb_to_sh
from dav_gswt.raster import render
from dav_gswt.reconstruction import top_view
from dav_gswt.reconstruction.evaluation import evaluate_field
from dav_gswt.reconstruction.fitting import descent, pose_refinement, sh_degree, snapshot, state, trainer
from dav_gswt.reconstruction.fitting.constraints import FreeConstraints
from dav_gswt.reconstruction.fitting.descent import HostDescent
from dav_gswt.reconstruction.fitting.plan import FitPlan, FitReport
from dav_gswt.reconstruction.fitting.pose_refinement import PoseCorrections
from dav_gswt.reconstruction.fitting.residual import Residual
from dav_gswt.reconstruction.ground_constraints import GroundConstraints
from dav_gswt.reconstruction.objects import make_blobs


def grey(field):
    return replace(field, sh=rgb_to_sh(np.full((len(field), 3), 0.5)))


def blotched(field):
    noise = np.random.default_rng(3).normal(0, 0.15, (len(field), 3))
    return replace(field, sh=rgb_to_sh(field.base_colours + noise))


def constrain():
    return GroundConstraints(made.grid(), np.full((32, 32), 0.5))


def fitted(field=None, plan=None, photos=None, keep=None):
    field = grey(made.field()) if field is None else field
    plan, options = plan or FitPlan(60, len(field)), trainer.FitOptions("test", keep)
    return trainer.fit_field(field, photos or made.photos(), plan, constrain(), np.random.default_rng(0), options)


def same(a, b):
    for name, values in vars(a).items():
        np.testing.assert_array_equal(values, getattr(b, name))


def test_a_fit_finds_the_colours_that_the_photos_show():
    photos, start = made.photos(), blotched(made.field())
    before = evaluate_field(start, photos[:1])["psnr"]
    assert evaluate_field(fitted(start).field, photos[:1])["psnr"] > before + 6


def test_things_above_the_ceiling_go_and_the_rest_stays():
    points = np.array([[1.6, 1.6, 3.0], [1.6, 1.6, 0.2]])
    field = concatenate_fields([made.field(), make_blobs(points, np.full((2, 3), 0.5), np.full(2, 0.05))])
    found = fitted(field, FitPlan(12, 1)).field
    assert len(found) == len(field) - 1
    assert found.means[-1, 2] == pytest.approx(0.2, abs=0.1)


def test_a_fit_grows_to_its_cap_and_no_further_and_its_ground_stays_a_ground():
    field, grid = grey(made.field()), made.grid()
    found = fitted(field, FitPlan(30, len(field) + 200)).field
    assert len(field) < len(found) <= len(field) + 200
    discs = found[: grid.heights.size]
    assert discs.ground.all()
    assert np.abs(discs.means[:, :2] - grid.centres[:, :2]).max() <= 0.49 * grid.spacing + 1e-6
    assert discs.opacity_logits.min() >= 2.5
    assert top_view.render_top_view(found, grid).alpha[2:-2, 2:-2].min() > 0.97  # closed, away from the border


def test_a_photo_with_another_exposure_does_not_change_the_field():
    photos = made.photos(3)
    dark = [photos[0], photos[1], replace(photos[2], image=(0.85 * photos[2].image).astype(np.float32))]
    plain, levelled = (fitted(photos=p, plan=FitPlan(90, 1)).field for p in (photos, dark))
    gone = evaluate_field(plain, photos[:2])["psnr"] - evaluate_field(levelled, photos[:2])["psnr"]
    assert gone < 3  # without levelling the common ground would be 5 % too dark: 26 dB at best, 8 dB lost


def blind(photo):
    return replace(photo, image=np.ones_like(photo.image), weight=np.zeros_like(photo.weight))


@pytest.mark.parametrize("plan", [FitPlan(14, 1400, half_share=0.3), FitPlan(14, "auto", "auto")])
def test_photos_without_a_pixel_that_counts_change_nothing(plan):
    photos = made.photos(4)
    some = [blind(photos[0]), *photos[:2], *map(blind, photos), *photos[2:]]
    alone, among = (fitted(plan=plan, photos=p) for p in (photos, some))
    same(alone.field, among.field)
    assert alone.report == among.report
    field = made.field()
    found = fitted(field, FitPlan(10, 1), photos=[blind(p) for p in made.photos()]).field
    np.testing.assert_array_equal(found.base_colours[found.ground], field.base_colours[field.ground])


@pytest.mark.parametrize("plan", [FitPlan(20, 1400, sh_degree=1), FitPlan(20, "auto", "auto")], ids=["numbers", "auto"])
def test_a_killed_fit_goes_on_from_its_snapshot_and_ends_with_the_same_field(plan, tmp_path, monkeypatch):
    whole = fitted(plan=plan)
    monkeypatch.setattr(snapshot, "EVERY", 0.0)  # after every step
    advance = trainer._advance

    def until(run, task, descent):
        if run.step == 13:
            raise RuntimeError
        advance(run, task, descent)

    with monkeypatch.context() as killed, pytest.raises(RuntimeError):
        killed.setattr(trainer, "_advance", until)
        fitted(plan=plan, keep=tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
    again = fitted(plan=plan, keep=tmp_path)
    same(whole.field, again.field)
    assert whole.report == again.report
    assert not list(tmp_path.iterdir())
    if plan.max_gaussians == "auto":  # what was chosen is reported
        chosen = {choice["what"]: choice["value"] for choice in whole.report.choices}
        assert chosen == {"cap": len(whole.field), "degree": whole.report.degree}
        assert whole.field.sh.shape[1] == (whole.report.degree + 1) ** 2
        assert [row["degree"] for row in whole.report.held_out] == [0, 1]


def digest(constraints):
    return trainer._digest(made.field(), made.photos(1), FitPlan(1, 1), constraints, np.random.default_rng(0))


def test_a_snapshot_is_of_one_set_of_constraints_the_code_that_runs_and_the_backend_in_use(monkeypatch):
    grid, ceiling = made.grid(), np.full((32, 32), 0.5)
    higher = ceiling.copy()
    higher[20, 20] = 0.6
    each = [
        FreeConstraints(0.1, 3.0),
        FreeConstraints(0.1, 4.0),
        GroundConstraints(grid, ceiling),
        GroundConstraints(grid, higher),
        GroundConstraints(replace(grid, heights=grid.heights + 0.1), ceiling),
        GroundConstraints(grid, ceiling, None),
        GroundConstraints(replace(grid, spacing=0.2), ceiling),
    ]
    assert len({digest(constraints) for constraints in each}) == len(each)
    constraints, before = constrain(), digest(each[2])
    assert digest(constraints) == before
    for module in ("trainer", "ground_constraints"):

        def digest_changed(path, module=module):
            return "another" if path.stem == module else code_digest.digest_code(path)

        with monkeypatch.context() as patch:
            patch.setattr(trainer, "digest_code", digest_changed)
            assert digest(constraints) != before
    monkeypatch.setattr(trainer.backends, "describe_backend", lambda: {"backend": "another"})
    assert digest(constraints) != before


def test_a_snapshot_that_is_none_costs_nothing(tmp_path, caplog):
    (tmp_path / "x.npz").write_bytes(b"no zip")
    assert snapshot.SnapshotStore(tmp_path, "x").load() is None and "begins anew" in caplog.text


def test_without_a_number_a_field_grows_where_errors_are_visible_and_not_where_none_are():
    photos, rng = made.photos(), np.random.default_rng(5)
    rough = [replace(p, image=p.image + rng.normal(0, 0.3, p.image.shape).astype(np.float32)) for p in photos]
    grown, kept = (len(fitted(blotched(made.field()), FitPlan(30, "auto"), p).field) for p in (rough, photos))
    assert grown > kept


def test_what_hardly_shows_in_any_photo_goes_before_the_end():
    points = np.array([[1.6, 1.6, 0.1], [1.4, 1.4, 0.1]])
    field = concatenate_fields([made.field(), make_blobs(points, np.full((2, 3), 0.5), np.full(2, 0.05), logit=0.0)])
    field.opacity_logits[-1] = -3.7  # an opacity of .024, above that with which a Gaussian stays
    found = fitted(field, FitPlan(10, len(field) + 1)).field.means[len(made.field()) :]
    firm, faint = (np.linalg.norm(found - point, axis=1).min(initial=9.0) for point in points)
    assert firm < 0.1 < faint


@pytest.mark.parametrize(
    "bad, word",
    [
        ({"sh_degree": 4}, "degree is 4"),
        ({"max_gaussians": -1}, "max_gaussians is -1"),
        ({"steps": -1}, "steps is -1"),
        ({"half_share": 1.0}, "half_share"),
        ({"pose_rate": -0.1}, "pose_rate"),
        ({"first_rate": 0.0}, "first_rate"),
        ({"first_rate": 1.5}, "first_rate"),
    ],
)
def test_a_plan_that_makes_no_sense_and_a_fit_without_views_are_refused(bad, word):
    with pytest.raises(ValueError, match=word):
        FitPlan(**({"steps": 10, "max_gaussians": 10} | bad))
    with pytest.raises(ValueError, match="at least one view"):
        trainer.fit_field(made.field(), [], FitPlan(1, 1), FreeConstraints(0.1, 3.0), np.random.default_rng(0))


def test_errors_are_noted_in_the_last_steps_before_each_growth_alone(monkeypatch):
    noted, grown = [], []
    descend, grow = HostDescent.descend, trainer._grow
    monkeypatch.setattr(descent, "ERROR_PHOTOS", 2)
    monkeypatch.setattr(Residual, "add", lambda *_: noted.append(now[0]))
    now = [0]

    def counting(self, run, task, index):
        now[0] = run.step
        descend(self, run, task, index)

    monkeypatch.setattr(HostDescent, "descend", counting)
    monkeypatch.setattr(trainer, "_grow", lambda run, task: grown.append(run.step) or grow(run, task))
    monkeypatch.setattr(trainer.densification, "grow", lambda *_: 0)
    fitted(plan=FitPlan(50, 10**4))
    assert len(grown) >= 10 and noted == [step for at in grown for step in (at - 2, at - 1)]


def test_corrections_compose_as_motions_of_the_camera():
    camera = made.photos(1)[0].camera
    poses = PoseCorrections(1)
    assert poses.correct(0, camera) is camera
    poses.descend(0, np.array([1.0, 0, 0, 0, -1, 0]), 0.01, camera)
    moved = poses.correct(0, camera)
    turn = Rotation.from_matrix(moved.rotation @ camera.rotation.T).as_rotvec()
    np.testing.assert_allclose(turn, [-0.01, 0, 0], atol=1e-9)  # Adam's first step is the rate, against the gradient
    shift = moved.translation - moved.rotation @ camera.rotation.T @ camera.translation
    np.testing.assert_allclose(shift, [0, 0.01 * camera.centre[2], 0], atol=1e-9)  # the rate times the height


def test_a_camera_that_is_off_finds_its_place(monkeypatch):
    photos = made.photos(3)
    camera = photos[2].camera
    off = replace(camera, translation=camera.translation + np.array([0.04, 0.0, 0.0]))
    used, constraints = [], constrain()
    monkeypatch.setattr(pose_refinement, "PoseCorrections", lambda n: used.append(PoseCorrections(n)) or used[0])
    constraints.detail = 1e-9  # the ground stays where it is
    views = [*photos[:2], replace(photos[2], camera=off)]
    trainer.fit_field(made.field(), views, FitPlan(200, 1, pose_rate=6e-4), constraints, np.random.default_rng(0))
    # a turn and a shift look alike on flat ground: judged by where the ground's middle is seen
    moved = used[0].correct(2, off)
    at = np.array([[1.6, 1.6, 0.0]])
    gone = np.linalg.norm(moved.project(at)[0] - camera.project(at)[0])
    before = np.linalg.norm(off.project(at)[0] - camera.project(at)[0])
    assert gone < 0.5 * before  # the rest is shared by the two others and the discs


def directed(strength):
    """The made-up field with colours that change with direction."""
    field = made.field()
    more = np.random.default_rng(0).normal(0, strength, (len(field), 3, 3)).astype(np.float32)
    return state.from_field(replace(field, sh=np.concatenate([field.sh, more], 1)))


def test_a_lower_degree_shows_what_the_photos_see_on_average():
    full, photos = directed(0.2), made.photos()
    cameras = [view.camera for view in photos]
    plain = full.copy()
    plain.resize_sh(0)
    folded = sh_degree.reduce_degree(full, 0, cameras)
    assert folded.sh_degree == 0 and full.sh_degree == 1

    def apart(now):
        pictures = [[render(state.to_field(s, 0), c).colour for s in (now, full)] for c in cameras]
        return np.mean([np.abs(a - b).mean() for a, b in pictures])

    assert apart(folded) < 0.5 * apart(plain)
    cameras = cameras[:1]  # one sees no difference at all
    assert apart(sh_degree.reduce_degree(full, 0, cameras)) < 1e-6


@pytest.mark.parametrize("gain, degree", [(0.01, 0), (1.0, 1)])
def test_the_least_degree_that_loses_little_is_chosen_and_reported(gain, degree):
    full, report = directed(0.2), FitReport()
    found = sh_degree.choose_degree(full, [made.photos(1)[0].camera], lambda now: 30 + gain * now.sh_degree, report)
    assert found.sh_degree == degree
    assert report.choices == [
        {"what": "degree", "value": degree, "why": f"degree 1 is worth {gain:+.3f} dB on held-out pixels"}
    ]
    assert [row["degree"] for row in report.held_out] == [0, 1]
