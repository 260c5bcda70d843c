"""Rule convert_lpips_weights: LPIPS's published weights, as safetensors."""

from dav_gswt.images import lpips_weights
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    lpips_weights.convert_weights(snakemake.input[0], snakemake.output.weights)
