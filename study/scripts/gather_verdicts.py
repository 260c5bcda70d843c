"""Rule gather_verdicts: the verdict on each scene and on each of its materials."""

from dav_gswt import csv_tables
from dav_gswt.logs import logging_to
from dav_gswt.materials import store

with logging_to(snakemake.log[0]):
    rows = []
    for folder, scene in zip(snakemake.input.materials, snakemake.params.scenes, strict=True):
        found = store.read_report(folder)
        whole = {"scene": scene, "of": "all", "share": 1 - found.excluded, "objects": len(found.objects)}
        rows.append(whole | vars(found.verdict))
        for number, each in enumerate(found.materials):
            own = sum(thing.material == number for thing in found.objects)
            part = {"scene": scene, "of": each.name, "share": each.share, "objects": own}
            rows.append(part | vars(each.verdict))
    for target in snakemake.output:
        csv_tables.write_table(target, rows)
