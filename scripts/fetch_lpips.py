"""Rule fetch_lpips: LPIPS's published weights, as safetensors."""

from dav_gswt.logs import logging_to
from dav_gswt.perceptual import weights

with logging_to(snakemake.log[0]):
    weights.fetch(snakemake.output.weights)
