"""Rule compare_fitters: other programs' fits and ours, of the same photos."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt_study import csv_tables, fit_profile, markdown, peers
from dav_gswt_study.machine import describe_machine

with logging_to(snakemake.log[0]):
    out, asked = snakemake.output, dict(snakemake.params.asked)
    program = peers.find_program(asked["opensplat"])  # before any work
    settings = FitSettings.from_preset(asked)
    folder = Path(snakemake.input.frame).parent
    photos = peers.select_photos(fit_profile.read_photo_set(folder, settings.fit_size, asked["margin"]))
    curves = {peers.OURS: fit_profile.profile_fit(photos, settings, every=asked["every"]).curve}
    curves |= peers.profile_others(program, photos, asked, Path(out.table).parent)
    rows = [{"program": program} | row for program, curve in curves.items() for row in curve]
    csv_tables.write_table(out.table, rows)
    peers.plot_programs(rows, out.plot)
    made = record_provenance({"frame": snakemake.input.frame}, asked) | describe_machine()
    values = peers.describe(rows, photos, asked, made)
    markdown.write_page(out.page, snakemake.input.template, values)
