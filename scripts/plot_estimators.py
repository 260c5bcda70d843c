"""Rule plot_estimators: the same test views after as many photos, chosen in different ways."""

from dav_gswt import field, views
from dav_gswt.active import evolution
from dav_gswt.coarse import ground
from dav_gswt.files import read_json
from dav_gswt.logs import logging_to
from dav_gswt.tables import estimators

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    key, found = evolution.measure(read_json(given.frame)), []
    for name, *paths in zip(params.named, given.fields, given.grounds, given.metrics, given.crops, strict=True):
        fitted, surface, measured, crops = paths
        read = field.read(fitted), ground.read(surface), read_json(measured)
        found.append(evolution.Round(params.rounds, *read, title=name, note=estimators.note(crops)))
    names = list(evolution.shown(found[0].metrics, key))
    tests = views.taken(given.images, given.model, names, [], params.size)
    evolution.write_figure(snakemake.output.plot, evolution.strips(found, tests, key), found, key)
