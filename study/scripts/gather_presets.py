"""Rule gather_preset_costs: what presets cost and what they are worth, as a table and as a page."""

from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables
from dav_gswt_study.markdown import write_page
from dav_gswt_study.tradeoff import preset_costs

with logging_to(snakemake.log[0]):
    out, params = snakemake.output, snakemake.params
    csv_tables.write_table(out.table, preset_costs.tabulate_presets(params.cells, params.size))
    rows = csv_tables.read_table(out.table, numbers=preset_costs.NUMBERS)
    values = preset_costs.describe_presets(rows) | {"size": params.size}
    write_page(out.page, snakemake.input.template, values)
