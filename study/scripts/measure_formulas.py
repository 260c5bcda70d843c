"""Rule measure_formulas: compare every formula with float64."""

from dav_gswt.files import write_json
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt_study import csv_tables
from dav_gswt_study.stability import registry

with logging_to(snakemake.log[0]):
    rows = [registry.measure_formula(about) for about in registry.read_descriptions()]
    csv_tables.write_table(snakemake.output.table, rows)
    write_json(snakemake.output.facts, record_provenance({}, {}) | {"source": snakemake.params.source})
