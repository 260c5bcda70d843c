"""Rule tabulate_paper: the paper's tables of timing, sensitivity and ablation."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables
from dav_gswt_study.tables import paper, spread

with logging_to(snakemake.log[0]):
    paths, out, params, asked = snakemake.input, snakemake.output, snakemake.params, snakemake.params.asked
    sweeps = {Path(path).stem: spread.read_sweep(path, paths.get("viewer")) for path in paths.sweeps}
    value = params.defaults[params.settings[asked["timing"]]]
    timing = paper.tabulate_timing(sweeps[asked["timing"]], value, params.families)
    varied = {params.settings[name]: sweeps[name] for name in asked["sensitivity"]}
    csv_tables.write_table(out.timing, timing)
    csv_tables.write_table(out.sensitivity, paper.tabulate_sensitivity(varied, params.defaults))
    ablated = {name: sweeps[name] for name in asked["ablation"]}
    csv_tables.write_table(out.ablation, paper.tabulate_ablation(ablated, params.baselines))
