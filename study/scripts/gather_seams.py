"""Rule gather_seams: crops of all experiments in one table, its summaries, and the page with its figure."""

from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables
from dav_gswt_study.markdown import write_page
from dav_gswt_study.seams import report, summary

with logging_to(snakemake.log[0]):
    out, params, cells, study = snakemake.output, snakemake.params, snakemake.params.cells, snakemake.params.study
    rows = [row for cell in cells for row in summary.tabulate_crops(cell)]
    csv_tables.write_table(out.crops, rows)
    compared = [
        row for row in rows if row["variant"] in study["tilings"] and row["replicate"] < study["compared_replicates"]
    ]
    ablation = summary.compare_variants(compared, study["baseline"])
    found = (summary.summarise_crops(rows), ablation)
    for new, kept, key in zip(found, out.kept, summary.KEYS, strict=True):
        csv_tables.update_table(kept, new, key)
    report.write_ablation(out.plot, ablation, study["baseline"])
    every, differences = (summary.read_seam_table(path) for path in out.kept)
    write_page(out.page, snakemake.input.template, report.describe_seams(every, differences, params.own))
