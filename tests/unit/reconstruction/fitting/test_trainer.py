from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt import code_digest
from dav_gswt.field import concatenate_fields, rgb_to_sh
from dav_gswt.reconstruction import top_view
from dav_gswt.reconstruction.evaluation import evaluate_field
from dav_gswt.reconstruction.fitting import descent, snapshot, trainer
from dav_gswt.reconstruction.fitting.constraints import FreeConstraints
from dav_gswt.reconstruction.fitting.descent import HostDescent
from dav_gswt.reconstruction.fitting.plan import FitPlan
from dav_gswt.reconstruction.fitting.residual import Residual
from dav_gswt.reconstruction.ground_constraints import GroundConstraints
from dav_gswt.reconstruction.objects import make_blobs


def grey(field):
    return replace(field, sh=rgb_to_sh(np.full((len(field), 3), 0.5)))


def blotched(field):
    noise = np.random.default_rng(3).normal(0, 0.15, (len(field), 3))
    return replace(field, sh=rgb_to_sh(field.base_colours + noise))


def fitted(field=None, plan=None, seed=0, photos=None, keep=None):
    field = grey(made.field()) if field is None else field
    grid = made.grid()
    constraints = GroundConstraints(grid, np.full(grid.shape, 0.5))
    plan = plan or FitPlan(60, len(field))
    return trainer.fit_field(
        field, photos or made.photos(), plan, constraints, np.random.default_rng(seed), trainer.FitOptions("test", keep)
    )


def same(a, b):
    for name, values in vars(a).items():
        np.testing.assert_array_equal(values, getattr(b, name))


def test_a_fit_finds_the_colours_that_the_photos_show():
    photos = made.photos()
    start = blotched(made.field())
    before = evaluate_field(start, photos[:1])["psnr"]
    assert evaluate_field(fitted(start).field, photos[:1])["psnr"] > before + 6


def test_the_ground_stays_a_ground():
    grid = made.grid()
    field = fitted(made.field(), FitPlan(30, 1)).field
    assert len(field) == len(made.field())
    discs = field[field.ground]
    assert len(discs) == grid.heights.size
    assert np.abs(discs.means[:, :2] - grid.centres[:, :2]).max() <= 0.49 * grid.spacing + 1e-6
    assert discs.opacity_logits.min() >= 2.5
    assert top_view.render_top_view(field, grid).alpha[2:-2, 2:-2].min() > 0.97  # closed, away from the border


def test_the_same_seed_gives_the_same_bits_whatever_the_threads(monkeypatch):
    found = []
    for threads in ("1", "2"):
        monkeypatch.setenv("DAV_GSWT_THREADS", threads)
        found.append(fitted(plan=FitPlan(20, 1600), seed=7).field)
    same(*found)


def test_things_above_the_ceiling_go_and_the_rest_stays():
    points = np.array([[1.6, 1.6, 3.0], [1.6, 1.6, 0.2]])
    field = concatenate_fields([made.field(), make_blobs(points, np.full((2, 3), 0.5), np.full(2, 0.05))])
    found = fitted(field, FitPlan(12, 1)).field
    assert len(found) == len(field) - 1
    assert found.means[-1, 2] == pytest.approx(0.2, abs=0.1)


def test_a_fit_grows_to_its_cap_and_no_further():
    field = grey(made.field())
    found = fitted(field, FitPlan(60, len(field) + 200))
    assert len(field) < len(found.field) <= len(field) + 200
    assert found.field.ground[: made.grid().heights.size].all()


def test_a_photo_with_another_exposure_does_not_change_the_field():
    photos = made.photos(3)
    dark = [photos[0], photos[1], replace(photos[2], image=(0.85 * photos[2].image).astype(np.float32))]
    plain, levelled = (fitted(photos=p, plan=FitPlan(90, 1)).field for p in (photos, dark))
    gone = evaluate_field(plain, photos[:2])["psnr"] - evaluate_field(levelled, photos[:2])["psnr"]
    assert gone < 3  # without levelling the common ground would be 5 % too dark: 26 dB at best, 8 dB lost


def blind(photo):
    return replace(photo, image=np.ones_like(photo.image), weight=np.zeros_like(photo.weight))


@pytest.mark.parametrize("plan", [FitPlan(30, 1400, half_share=0.3), FitPlan(30, "auto", "auto")])
def test_photos_without_a_pixel_that_counts_change_nothing(plan):
    photos = made.photos(4)
    some = [blind(photos[0]), *photos[:2], *map(blind, photos), *photos[2:]]
    alone, among = (fitted(plan=plan, photos=p) for p in (photos, some))
    same(alone.field, among.field)
    assert alone.report == among.report


def test_photos_of_which_no_pixel_counts_leave_the_ground_as_it_was():
    field = made.field()
    found = fitted(field, FitPlan(10, 1), photos=[blind(p) for p in made.photos()]).field
    np.testing.assert_array_equal(found.base_colours[found.ground], field.base_colours[field.ground])


class Killed(Exception):
    pass


@pytest.mark.parametrize("plan", [FitPlan(30, 1400, sh_degree=1), FitPlan(30, "auto", "auto")], ids=["numbers", "auto"])
def test_a_killed_fit_goes_on_from_its_snapshot_and_ends_with_the_same_field(plan, tmp_path, monkeypatch):
    whole = fitted(plan=plan)
    monkeypatch.setattr(snapshot, "EVERY", 0.0)  # after every step
    advance, count = trainer._advance, [0]

    def until(run, task, descent):
        if count[0] == 17:
            raise Killed
        count[0] += 1
        advance(run, task, descent)

    monkeypatch.setattr(trainer, "_advance", until)
    with pytest.raises(Killed):
        fitted(plan=plan, keep=tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
    monkeypatch.setattr(trainer, "_advance", advance)
    again = fitted(plan=plan, keep=tmp_path)
    same(whole.field, again.field)
    assert whole.report == again.report
    assert not list(tmp_path.iterdir())


def digest(constraints):
    return trainer._digest(made.field(), made.photos(1), FitPlan(1, 1), constraints, np.random.default_rng(0))


def test_a_snapshot_is_of_one_set_of_constraints():
    grid, ceiling = made.grid(), np.full((32, 32), 0.5)
    higher = ceiling.copy()
    higher[20, 20] = 0.6
    raised = replace(grid, heights=grid.heights + 0.1)
    free = [FreeConstraints(0.1, 3.0), FreeConstraints(0.2, 3.0), FreeConstraints(0.1, 4.0)]
    each = [
        *free,
        GroundConstraints(grid, ceiling),
        GroundConstraints(grid, higher),
        GroundConstraints(raised, ceiling),
    ]
    each += [GroundConstraints(grid, ceiling, None), GroundConstraints(replace(grid, spacing=0.2), ceiling)]
    assert len({digest(constraints) for constraints in each}) == len(each)
    assert digest(GroundConstraints(grid, ceiling)) == digest(GroundConstraints(made.grid(), ceiling.copy()))


@pytest.mark.parametrize("module", ["trainer", "ground_constraints"])
def test_a_snapshot_is_of_the_code_that_the_fit_runs(module, monkeypatch):
    """That of the rasterizer too, which the first of the two imports."""
    constraints = GroundConstraints(made.grid(), np.full((32, 32), 0.5))
    before = digest(constraints)
    monkeypatch.setattr(
        trainer, "digest_code", lambda path: "another" if path.stem == module else code_digest.digest_code(path)
    )
    assert digest(constraints) != before


def test_a_snapshot_is_of_the_backend_in_use(monkeypatch):
    constraints = FreeConstraints(0.1, 3.0)
    before = digest(constraints)
    monkeypatch.setattr(trainer.backends, "describe_backend", lambda: {"backend": "another"})
    assert digest(constraints) != before


def test_a_snapshot_that_is_none_costs_nothing(tmp_path, monkeypatch, caplog):
    keeper = snapshot.SnapshotStore(tmp_path, "x")
    (tmp_path / "x.npz").write_bytes(b"no zip")
    assert keeper.load() is None
    assert "begins anew" in caplog.text


def test_a_choice_is_reported_with_its_reason():
    found = fitted(plan=FitPlan(60, "auto", "auto"))
    report = found.report
    assert {choice["what"]: choice["value"] for choice in report.choices} == {
        "cap": len(found.field),
        "degree": report.degree,
    }
    assert found.field.sh.shape[1] == (report.degree + 1) ** 2
    assert [row["degree"] for row in report.held_out] == [0, 1]


def test_without_a_number_a_field_grows_where_errors_are_visible_and_not_where_none_are():
    photos = made.photos()
    rng = np.random.default_rng(5)
    rough = [replace(p, image=p.image + rng.normal(0, 0.3, p.image.shape).astype(np.float32)) for p in photos]
    grown, same_size = (
        len(fitted(blotched(made.field()), FitPlan(60, "auto"), photos=p).field) for p in (rough, made.photos())
    )
    assert grown > same_size


def test_what_hardly_shows_in_any_photo_goes_before_the_end():
    points = np.array([[1.6, 1.6, 0.1], [1.4, 1.4, 0.1]])
    field = concatenate_fields([made.field(), make_blobs(points, np.full((2, 3), 0.5), np.full(2, 0.05), logit=0.0)])
    field.opacity_logits[-1] = -3.7  # an opacity of .024, above that with which a Gaussian stays
    found = fitted(field, FitPlan(10, len(field) + 1)).field.means[len(made.field()) :]
    firm, faint = (np.linalg.norm(found - point, axis=1).min(initial=9.0) for point in points)
    assert firm < 0.1 < faint


def test_a_plan_refuses_what_makes_no_sense():
    with pytest.raises(ValueError, match="degree is 4"):
        FitPlan(10, 10, 4)
    with pytest.raises(ValueError, match="steps is -1"):
        FitPlan(-1, 10)
    with pytest.raises(ValueError, match="half_share"):
        FitPlan(10, 10, half_share=1.0)
    with pytest.raises(ValueError, match="at least one view"):
        trainer.fit_field(
            made.field(),
            [],
            FitPlan(1, 1),
            GroundConstraints(made.grid(), np.zeros((32, 32))),
            np.random.default_rng(0),
        )


def test_a_long_fit_of_a_field_that_is_not_sharp_keeps_its_brightness():
    rng = np.random.default_rng(5)
    grain = [rng.normal(0, 0.15, p.image.shape).astype(np.float32) for p in made.photos()]
    photos = [replace(p, image=p.image + g) for p, g in zip(made.photos(), grain, strict=True)]
    found = fitted(
        plan=FitPlan(400, 1), photos=photos
    )  # grain that no field can show: least squares finds gains below 1
    seen = [made.render(found.field, p.camera) for p in made.photos()]
    apart = [(s.colour - p.image)[8:-8, 8:-8].mean() for s, p in zip(seen, made.photos(), strict=True)]
    assert abs(np.mean(apart)) < 0.01


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
    fitted(plan=FitPlan(60, 10**4))
    assert len(grown) >= 10 and noted == [step for at in grown for step in (at - 2, at - 1)]
