"""Rule measure_materials: materials and objects of a synthetic scene against its true labels."""

from dav_gswt.logs import logging_to
from dav_gswt.photos.synthetic.scene import scene_from_config
from dav_gswt_study import csv_tables
from dav_gswt_study.materials import accuracy, true_labels

with logging_to(snakemake.log[0]):
    truth = true_labels.draw_scene_labels(scene_from_config(snakemake.params.scene))
    found = accuracy.read_found_labels(snakemake.input.materials)
    row = accuracy.score_materials(truth, found) | accuracy.score_objects(truth, found)
    csv_tables.write_table(snakemake.output.table, [row | {"excluded": float(found.excluded.mean())}])
