"""The kit: an offline page that does not reveal which crop is which, and the key that does."""

import json
import shutil
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder, write_json
from dav_gswt_study.forced_choice import trials
from dav_gswt_study.forced_choice.store import StoredPair

TRIALS, PICTURES = "trials.js", "pictures"


def write_kit(
    page: Path | str, key: Path | str, parts: Path, pairs: list[StoredPair], seed: int, seconds: float
) -> None:
    """Write the page's folder, which appears whole or not at all, and the key beside it.

    parts: the folder of the page's HTML, style and script. seconds: for which pictures are shown.
    The lists are a script, not JSON: a page that is opened as a file may run scripts, but not read files.
    Raises: InputError: the page's parts are missing, or there is no pair.
    """
    if not (parts / "index.html").is_file():
        raise InputError(f"{parts}: no page here (index.html is missing)")
    if not any(not pair.check for pair in pairs):
        raise InputError("perceptual_study: there is no pair to show; ask for `pairs` and `crops`")
    answer_key = trials.make_key(pairs, seed)
    with atomic_folder(page) as part:
        for path in sorted(parts.iterdir()):
            shutil.copyfile(path, part / path.name)
        (part / PICTURES).mkdir()
        # in the names' order, so that the files' times say nothing either
        for name, data in sorted(trials.name_pictures(pairs, seed).items()):
            (part / PICTURES / f"{name}.png").write_bytes(data)
        study = {"study": answer_key["study"], "seconds": seconds, "lists": answer_key["lists"]}
        text = json.dumps(study, separators=(",", ":"), allow_nan=False)
        (part / TRIALS).write_text(f'"use strict";\nconst STUDY = {text};\n', encoding="utf-8")
    write_json(key, answer_key)
