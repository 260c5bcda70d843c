"""Rule measure_orders: what the orders of a bundle's tiles cost a viewer, and how well they serve a picture."""

from pathlib import Path

from dav_gswt.bundle.orders import measure_orders
from dav_gswt.bundle.store import read_bundle
from dav_gswt.files import write_json
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    bundle = read_bundle(Path(snakemake.input.manifest).parent)
    write_json(snakemake.output.measured, measure_orders(bundle))
