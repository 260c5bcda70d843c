from dataclasses import replace

from fixtures import ground as made

from dav_gswt.reconstruction.opacity_uncertainty import estimate_uncertainty


def test_ground_that_no_photo_sees_is_uncertain_and_the_rest_is_not():
    photos = [replace(photo, weight=photo.weight.copy()) for photo in made.photos(1)]
    photos[0].weight[:, :24] = 0
    field = estimate_uncertainty(made.field(), photos)
    field = field[field.ground]
    pixels, _ = photos[0].camera.project(field.means.astype(float))
    inside = (pixels > 2).all(1) & (pixels < 46).all(1)
    assert field.uncertainty[inside & (pixels[:, 0] > 27)].max() < 0.1
    assert field.uncertainty[inside & (pixels[:, 0] < 21)].min() == 1
