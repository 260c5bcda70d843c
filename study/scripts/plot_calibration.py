"""Rule plot_calibration: which scores say where the field is wrong?"""

from dav_gswt.files import read_json, write_json
from dav_gswt.images import figures
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt_study import csv_tables
from dav_gswt_study.calibration import report

with logging_to(snakemake.log[0]):
    out, paths = snakemake.output, snakemake.input.cells
    found = [read_json(path) for path in paths]
    table = report.tabulate_scores(snakemake.params.cells, found)
    csv_tables.write_table(out.table, table)
    figures.save_figure(report.draw_figure(table), out.plot)
    about = {path: f["provenance"]["parameters"] for path, f in zip(paths, found, strict=True)}
    write_json(out.facts, record_provenance(dict(zip(paths, paths, strict=True)), about))
