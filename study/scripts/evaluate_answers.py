"""Rule evaluate_answers: choices of participants and of the model observer."""

from dav_gswt.files import write_json
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt_study import csv_tables
from dav_gswt_study.forced_choice import answers, results

with logging_to(snakemake.log[0]):
    paths, out = snakemake.input, snakemake.output
    key, files = answers.read_key(paths.key), list(paths.get("answers", []))
    people = answers.read_answers(files, key, paths.schema)
    rows = results.tabulate_choices(key, people.participants)
    csv_tables.write_table(out.table, rows)
    results.write_choice_plot(out.plot, rows)
    origin = record_provenance({"key": paths.key, "answers": files}, {"study": key["study"]})
    write_json(out.facts, people.facts | {"provenance": origin})
