"""Rule copy_chosen_photos: the photos of another preset's round, and why they were chosen."""

import shutil
from dataclasses import replace

from dav_gswt.logs import logging_to
from dav_gswt.views.selection import read_pose_selection, write_pose_selection

with logging_to(snakemake.log[0]):
    given, made = snakemake.input, snakemake.output
    chosen = replace(read_pose_selection(given.poses), chosen_with=snakemake.params.chooser)
    shutil.copytree(given.capture, made.capture, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".*"))
    write_pose_selection(made.poses, chosen)
