"""Rule gather_preset_costs: what presets cost and are worth, as a table and as a page."""

from dav_gswt import csv_tables
from dav_gswt.logs import logging_to
from dav_gswt_study import markdown
from dav_gswt_study.tradeoff import preset_costs

with logging_to(snakemake.log[0]):
    out, params = snakemake.output, snakemake.params
    csv_tables.write_table(out.table, preset_costs.tabulate_presets(params.cells, params.size))
    rows = csv_tables.read_table(out.table, numbers=preset_costs.NUMBERS)
    markdown.write_page(out.page, preset_costs.format_presets(rows, params.size))
