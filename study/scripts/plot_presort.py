"""Rule plot_presort: errors of the page's approximations in pictures of several scenes."""

from dav_gswt.files import copy_file
from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables
from dav_gswt_study.terrain import presort

with logging_to(snakemake.log[0]):
    presort.write_presort_plot(snakemake.output.plot, csv_tables.read_table(snakemake.input.table))
    copy_file(snakemake.output.plot, snakemake.output.kept)
    copy_file(snakemake.input.table, snakemake.output.data)
