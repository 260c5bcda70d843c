"""Functions that rules use: parameters, resources, and the inputs of each stage, in the order of the stages."""


def integer(wildcard):
    """A params function: the value of a wildcard, as an int."""
    return lambda wildcards: int(wildcards[wildcard])


def real(wildcard):
    """A params function: the value of a wildcard, as a float."""
    return lambda wildcards: float(wildcards[wildcard])


def entry(table, wildcard):
    """A params function: the config's entry of a table that a wildcard names."""
    return lambda wildcards: config[table][wildcards[wildcard]]


def scene_keys(rule):
    """A params function: what a rule reads of the scene's entry."""

    def select(wildcards):
        scene = config["scenes"][wildcards.scene]
        return select_keys(SCENES[scene["kind"]], rule, scene)

    return select


def preset_keys(rule):
    """A params function: what a rule reads of the preset."""
    return lambda wildcards: select_keys(Preset, rule, config["presets"][wildcards.preset])


def export_keys(rule):
    """A params function: what a rule reads of `export`."""
    return lambda wildcards: select_keys(Export, rule, config["export"])


def per_attempt(need):
    """A resources function: `need` at the first attempt, twice as much at the second; 2000, or "60m".

    A job that ran out of memory or time and is tried again (`retries` of a profile) would else run out of it again.
    """
    amount, unit = re.fullmatch(r"(\d+)([mh]?)", str(need)).groups()
    return lambda wildcards, attempt: f"{int(amount) * attempt}{unit}" if unit else int(amount) * attempt


def code_of(script):
    """A params function: a digest of the library code that a script runs."""
    return lambda wildcards: digest_code(BASE / f"scripts/{script}.py")


def scenes_of(*kinds):
    """A constraint: the config's scenes of these kinds."""
    return "|".join(name for name, scene in config["scenes"].items() if scene["kind"] in kinds) or NEVER


def scenes_by(*agents):
    """A constraint: the config's scenes that these agents photograph."""
    return "|".join(name for name, scene in config["scenes"].items() if scene.get("agent") in agents) or NEVER


TEMPLATE = re.compile(r"[{}<>]")  # Snakemake takes {name} and <name> in a path for a wildcard or a variable


def existing(path, where, hint="", escaped=True):
    """A path that the config names (`locate_path`). escaped: it becomes an input of Snakemake.

    Raises: WorkflowError: it is not there, cannot be an input, or is a file from the future.
    """
    found = locate_path(path, BASE)
    if not found.exists():
        raise WorkflowError(f"config: {where}: there is no {path}{hint}")
    if escaped and TEMPLATE.search(str(found)):
        raise WorkflowError(f"config: {where}: {found} has one of the letters {{ }} < >: rename the file or folder")
    return dated(found, where)


def dated(path, where):
    """A path, as text. Raises: WorkflowError: a file from the future, so that each result would be older than it."""
    if path.is_file() and is_from_future(path):
        raise WorkflowError(
            f"config: {where}: {path} is dated in the future: correct this machine's clock, or touch it"
        )
    return str(path)


def files_of_model(path, where):
    """The files of another program's model, as inputs: of a folder its own and those of the folders in it."""
    found = Path(existing(path, where, escaped=False))
    if not found.is_dir():
        return [str(found)]
    try:
        files = [file for depth in ("", "[!.]*/", "[!.]*/[!.]*/") for file in sorted(found.glob(f"{depth}[!.]*"))]
    except OSError as error:
        raise WorkflowError(f"config: {where}: {path} cannot be read ({error.strerror})") from None
    return [dated(file, where) for file in files if file.is_file()]


def lpips_weights(wildcards=None):
    """LPIPS's weights as an input of what cuts, scores and measures with them; none where the config says so."""
    return {} if config["lpips"] == "none" else {"lpips": locate_weights(config["lpips"])}


def terrain_weights(prior):
    """The file of weights of an entry of `priors` of model terrain."""
    weights = config["priors"][prior].get("weights")
    return existing(weights, f"priors.{prior}.weights") if weights else str(LIBRARY / "prior/terrain.safetensors")


def round_folder(t):
    """The folder that round t left; round 0 is the coarse field."""
    return f"<results>/<active>/iter{t}" if t else "<results>/<coarse>"


def chooser_of(preset):
    """The preset whose rounds choose the photos of a preset's fit: its own, or another's."""
    return config["presets"][preset].get("choose_with") or preset


def is_windowed(values):
    """Whether the field of these wildcards is fitted in windows."""
    return paths.fits_windows(config, values["scene"], values["preset"])


def values_of_choice(values):
    """The wildcards of the rounds that choose a field's photos and windows. Another preset may run these rounds."""
    return values | ({"preset": chooser_of(values["preset"])} if values["t"] or is_windowed(values) else {})


def chosen_folder(stage, wildcards, t=""):
    """The folder of a stage of the preset that chooses the photos: `coarse`, `scored`, or `round` t."""
    template = paths.stage_template(stage).replace("{preset}", chooser_of(wildcards.preset))
    return f"<results>/{template.replace('{t}', str(t))}"


def chosen_round(wildcards, t):
    """The folder that round t of that preset left; round 0 is its coarse field."""
    return chosen_folder("round" if t else "coarse", wildcards, t)


def captures_until(wildcards):
    """The photos that rounds 1 to t took."""
    return [f"{round_folder(t)}/capture" for t in range(1, int(wildcards.t) + 1)]


def captures_before(wildcards):
    """The photos that rounds 1 to t - 1 took."""
    return captures_until(wildcards)[:-1]


def round_before(wildcards):
    """The field that round t starts from, and its scores."""
    t = int(wildcards.t) - 1
    scores = round_folder(t) if t else "<results>/<scored>"
    return {
        "field": f"{round_folder(t)}/field.ply",
        "ground": f"{round_folder(t)}/ground.exr",
        "scores": f"{scores}/scores.csv",
        "maps": f"{scores}/maps.npz",
    }


def branch(scene, policy=None, changes=None):
    """The wildcards of what is made of a scene, by the config or by settings that replace some of its own."""
    return paths.encode_branch(config, scene, policy, changes)


def source_files(scene):
    """The files that registration reads, by what they are: photos, or a video; masks, another program's model."""
    given, where = config["scenes"][scene], f"scenes.{scene}"
    for key in ("folder", "masks"):
        for path in [given[key]] if isinstance(given.get(key, []), str) else given.get(key, []):
            existing(path, f"{where}.{key}", escaped=False)
    try:
        listing = list_photos(locate_source(given["folder"]), locate_path(given["masks"]) if "masks" in given else None)
    except (InputError, OSError) as error:
        raise WorkflowError(f"config: {where}.folder: {error}") from None
    videos = [] if listing.photos else listing.files.get("video", [])[:1]
    once, _ = drop_twins(listing.photos)  # a copy that is added changes no input
    found = {"photos": [dated(path, f"{where}.folder") for path in once.values()]}
    found["video"] = [dated(path, f"{where}.folder") for path in videos]
    found["masks"] = [dated(path, f"{where}.masks") for path in listing.masks.values()]
    found["model"] = files_of_model(given["model"], f"{where}.model") if "model" in given else []
    found["positions"] = [dated(path, f"{where}.folder") for path in list_geo_files(list(listing.photos.values()))]
    return found


def source_photos(wildcards):
    """A scene's photos and what belongs to them, as inputs."""
    found = source_files(wildcards.scene)
    frames = {"frames": "<results>/<frames>"} if found.pop("video") else {}
    return frames | {key: [path for path in files if not TEMPLATE.search(path)] for key, files in found.items()}


def unnameable_photos(wildcards):
    """A params function: size and time of the files that cannot be inputs, as Snakemake would read wildcards in their
    paths; a change of them runs the rule again."""
    found = [Path(path) for files in source_files(wildcards.scene).values() for path in files if TEMPLATE.search(path)]
    return [f"{path} {path.stat().st_size} {path.stat().st_mtime_ns}" for path in found]


def source_video(wildcards):
    """The video that a scene names in place of photos."""
    video = source_files(wildcards.scene)["video"]
    if not video:
        raise WorkflowError(f"config: scenes.{wildcards.scene}.folder: has no video")
    return existing(video[0], f"scenes.{wildcards.scene}.folder")


def source_field(wildcards):
    """A scene's finished field."""
    return existing(config["scenes"][wildcards.scene]["field"], f"scenes.{wildcards.scene}.field")


def prior_weights(wildcards):
    """What scoring reads beside the field: the weights of the prior and of LPIPS."""
    if wildcards.prior == "none":
        return {}
    prior, files = config["priors"][wildcards.prior], lpips_weights(wildcards)
    if prior["model"] == "terrain":
        return files | {"weights": terrain_weights(wildcards.prior)}
    return files | {"folder": existing(prior["weights"], f"priors.{wildcards.prior}.weights", "; see docs/prior.md")}


def pictures_that_tell(wildcards):
    """The photos so far, for the policies that measure the field's error in them."""
    return {"images": "<results>/<photos>/images"} if wildcards.policy in NEEDS_PHOTOS else {}


def inpainter_weights(wildcards):
    """The weights of the prior that inpaints."""
    return {"weights": terrain_weights(wildcards.inpainter)}


def draft_of(wildcards):
    """The field that says where materials are, and its ground: the round's own, or the draft of a field of windows."""
    windowed = is_windowed(wildcards)
    folder = chosen_round(wildcards, int(wildcards.t)) if windowed else "<results>/<round>{inpainted}"
    fitted = {"windows": "<results>/<round>/windows"} if windowed else {}
    return fitted | {"field": f"{folder}/field.ply", "ground": f"{folder}/ground.exr"}


def windows_of_round(wildcards):
    """The windows of a field that was fitted in such, to measure them by themselves."""
    return {"windows": "<results>/<round>/windows"} if is_windowed(wildcards) else {}


def draft_of_windows(wildcards):
    """The draft field that windows are chosen by, and its ground."""
    folder = chosen_round(wildcards, int(wildcards.t))
    return {"draft": f"{folder}/field.ply", "draft_ground": f"{folder}/ground.exr"}


def maps_of_prior(wildcards):
    """The uncertainty maps of a round by its prior. Without a prior the field itself says what is known."""
    if wildcards.prior == "none":
        return {}
    stage = "scored" if wildcards.t == "0" else "round"
    if is_windowed(wildcards):
        return {"maps": f"{chosen_folder(stage, wildcards, wildcards.t)}/maps.npz"}
    return {"maps": f"<results>/<{stage}>/maps.npz"}


def materials_of(wildcards):
    """The materials of a scene that tells them apart."""
    asked = config["scenes"][wildcards.scene].get("materials", "one") != "one"
    return {"materials": "<results>/<materials>"} if asked else {}


def masks_of_materials(wildcards):
    """The images that name a scene's materials, where the config has such."""
    named = config["scenes"][wildcards.scene].get("materials")
    where = f"scenes.{wildcards.scene}.materials"
    files = named if isinstance(named, dict) else {}
    return {f"mask_{name}": existing(file, f"{where}.{name}") for name, file in files.items()}


def tiling_inputs(name):
    """What tells the kinds of ground apart, beside colours: LPIPS's features, SAM 2's checkpoint."""
    tiling = config["tilings"][name]
    if tiling["energy"] == "colour":
        return {}
    if "sam2" not in tiling:
        return lpips_weights()
    where = f"tilings.{name}.sam2"
    folder = existing(tiling["sam2"], where)
    return lpips_weights() | {"sam2": existing(f"{folder}/model.safetensors", where)}


def photos_of_field(wildcards):
    """All photos that a round's field was made of, or the finished field that came instead."""
    if config["scenes"][wildcards.scene]["kind"] == "field":
        return {"photos": "<results>/<photos>/field.ply"}
    return {"photos": ["<results>/<photos>/images", *captures_until(wildcards)]}


def metrics_before(wildcards):
    """What tests said of the first fit and of rounds 1 to t - 1, by the preset that chose their photos."""
    return [f"{chosen_round(wildcards, t)}/metrics.json" for t in range(int(wildcards.t))]


def story_of_field(wildcards):
    """The photos that a round's field was made of, and what tests said of each; nothing for a finished field."""
    if config["scenes"][wildcards.scene]["kind"] == "field":
        return {}
    t = int(wildcards.t)
    last = "<results>/<round>" if is_windowed(wildcards) else round_folder(t)
    return {
        "views": "<results>/<start>/views.json",
        "images": "<results>/<photos>/images",
        "model": "<results>/<photos>/sparse",
        "frame": "<results>/<photos>/ground.json",
        "captures": captures_until(wildcards),
        "metrics": [*metrics_before(wildcards), f"{last}/metrics.json"],
    }


def height_map(wildcards):
    """The image that the terrain's surface is read from, where the config names one."""
    file = config["heights"].get("file")
    if not file:
        return {}
    from dav_gswt.terrain.heights import read_height_map  # here, not above: most plans need none

    found = existing(file, "heights.file")
    try:
        read_height_map(found)
    except InputError as error:
        raise WorkflowError(f"config: heights.file: {error}") from None
    return {"map": found}


def painted_files(wildcards):
    """The painted file that the rule of classes reads."""
    files = [term["file"] for term in config["classes"] if term["kind"] == "painted"]
    return {f"painted{number}": existing(file, "classes.file") for number, file in enumerate(files)}


def terrain_targets(scene):
    """A scene's terrain: page, stills and a sheet of them."""
    made = [rules.make_page.output.page, *rules.render_terrain.output.stills, rules.make_contact_sheet.output.sheet]
    return expand(made, **branch(scene))


def photo_targets(scene):
    """The photo report, the metrics of each round, those before the last of the preset that chose, and its scores."""
    if config["scenes"][scene]["kind"] == "field":
        return []
    values = branch(scene)
    chosen, rounds = values_of_choice(values), values["t"]
    scored = rules.score_round.output if rounds else rules.score_coarse.output
    return (
        expand(rules.report_photos.output.page, scene=scene)
        + expand(rules.evaluate_coarse.output.metrics, **chosen)
        + expand([rules.evaluate_round.output.metrics] * (rounds > 1), **(chosen | {"t": range(1, rounds)}))
        + expand([rules.evaluate_round.output.metrics] * bool(rounds or is_windowed(values)), **values)
        + expand(list(scored), **(chosen if is_windowed(values) else values))
    )


SWEPT_POLICY = "w2-lpips"  # the paper's, where the config's policy does not sample the prior


def experiment_branch(scene, changes):
    """The wildcards of a run with settings that replace the config's. Nothing is inpainted."""
    return branch(scene, changes=changes) | {"inpainted": ""}


def sweep_cells(sweep):
    """The cells of a sweep: for each value and seed the settings, the files and the benchmarks of a run."""
    scene, cells = config["scene"], {}
    if config["scenes"][scene]["kind"] == "field":
        raise WorkflowError(f"sweeps: {scene} is a finished field; a sweep needs a scene with photos")
    policy = config["policy"] if config["policy"] in PRIOR_POLICIES else SWEPT_POLICY
    for value in config["sweeps"][sweep]:
        values = experiment_branch(scene, {"policy": policy, sweep: value})
        for seed in config["seeds"]:
            cell = describe_run(values | {"seed": seed}, ["views", "tiles"])
            cells.setdefault(tuple(cell[key] for key in CELL), cell)
    return list(cells.values())


def describe_run(values, measured):
    """A cell: the settings of a run, the files that measure it, and the benchmarks of its jobs.

    measured: any of views (the last field's metrics), tiles (the bundle) and stills.
    """
    rounds, chosen = values["t"], values_of_choice(values)

    def of(made, ts=None, wildcards=values):
        return expand(made, **(wildcards if ts is None else wildcards | {"t": list(ts)}))

    windowed = is_windowed(values)
    tested = rules.evaluate_round if rounds or windowed else rules.evaluate_coarse
    files = {"metrics": tested.output.metrics} if "views" in measured else {}
    bundled = {"manifest": rules.bundle_tiles.output.manifest, "orders": rules.measure_orders.output.measured}
    files |= bundled if "tiles" in measured else {}
    files |= {"still": rules.render_terrain.output.stills[0]} if "stills" in measured else {}
    times = {"coarse": of(rules.fit_coarse.benchmark, [rounds], chosen)}
    times["update"] = of(rules.update_field.benchmark, range(1, rounds + 1), chosen)
    last = rules.fit_windows if windowed else rules.fit_chosen_photos
    times["update"] += of(last.benchmark) if chosen != values else []
    times["score"] = of(rules.score_coarse.benchmark, [rounds], chosen) if rounds else []
    times["score"] += of(rules.score_round.benchmark, range(1, rounds), chosen)
    for key, job in (("select", rules.select_poses), ("capture", rules.capture_views)):
        times[key] = of(job.benchmark, range(1, rounds + 1), chosen)
    if measured != ["views"]:
        times |= {"levels": of(rules.make_levels.benchmark), "cut": of(rules.cut_tiles.benchmark)}
    times |= {"bundle": of(rules.bundle_tiles.benchmark)} if {"tiles", "stills"} & set(measured) else {}
    times |= {"stills": of(rules.render_terrain.benchmark)} if "stills" in measured else {}
    cell = {key: values[key] for key in CELL if key != "rounds"} | {"rounds": rounds}
    corrected = config["scenes"][values["scene"]]["kind"] == "photos"
    return cell | {"corrected": corrected, "files": {key: of(path)[0] for key, path in files.items()}, "times": times}


def timed_cells():
    """The cells of the timing table: the swept scene with the config's settings."""
    policy = config["policy"] if config["policy"] in PRIOR_POLICIES else SWEPT_POLICY
    values = experiment_branch(config["scene"], {"policy": policy})
    return [describe_run(values | {"seed": seed}, ["views", "tiles", "stills"]) for seed in config["seeds"]]
