"""The panel that says how a terrain was made."""

import pytest
from playwright.sync_api import Error

PHOTOS = [{"round": int(k > 2), "at": [k - 2.0, 1.0, 3.0], "look": [0.5, -0.5], "picture": k} for k in range(5)]
ROUNDS = [{"photos": 3, "psnr": 27.1, "preset": "draft"}, {"photos": 2, "psnr": None}]
VALUE = dict(unit="metre", half=2.0, photos=PHOTOS, rounds=ROUNDS, thumb=120, columns=8, pictures=5)


@pytest.mark.parametrize(
    "change, sound",
    [
        ({"more": 1}, True),
        ({"unit": 3}, False),
        ({"half": 0}, False),
        ({"thumb": 0}, False),
        ({"columns": 65}, False),
        ({"photos": 3}, False),
        ({"photos": [{"round": 0, "at": ["1", 2, 3], "look": [0, 0]}]}, False),
        ({"photos": [{"round": 0, "at": [1, 2, 3], "look": [0]}]}, False),
        ({"photos": [PHOTOS[0] | {"picture": 5}]}, False),
        ({"rounds": [{"photos": -1, "psnr": 1}]}, False),
        ({"rounds": [{"photos": 1, "psnr": "1"}]}, False),
        ({"rounds": [{"photos": 1, "psnr": 1, "preset": 3}]}, False),
    ],
)
def test_a_story_is_read_or_refused(call, change, sound):
    if sound:
        assert call("ui/story.js", "readStory", VALUE | change) == VALUE
    else:
        with pytest.raises(Error, match="story.json is not as the workflow writes it"):
            call("ui/story.js", "readStory", VALUE | change)
