"""Rule gather_seams: crops of all experiments in one table, its summaries, and a figure."""

from dav_gswt import csv_tables
from dav_gswt.logs import logging_to
from dav_gswt_study.seams import plots, summary, tables

with logging_to(snakemake.log[0]):
    out, cells, study = snakemake.output, snakemake.params.cells, snakemake.params.study
    rows = [row for cell in cells for row in tables.tabulate_crops(cell)]
    csv_tables.write_table(out.crops, rows)
    compared = [
        row for row in rows if row["variant"] in study["tilings"] and row["replicate"] < study["compared_replicates"]
    ]
    found = {
        out.summary: summary.summarise_crops(rows),
        out.ablation: summary.compare_variants(compared, study["baseline"]),
        out.repetition: [row for cell in cells if "repeats" in cell for row in tables.tabulate_repetition(cell)],
    }
    for (path, new), kept, key in zip(found.items(), out.kept, tables.KEYS, strict=True):
        csv_tables.write_table(path, new)
        csv_tables.update_table(kept, new, key)
    plots.write_ablation(out.plot, found[out.ablation], study["baseline"])
