"""Weights of LPIPS, which come with the set-up. The project's own prior comes with the library; rules/study/prior.smk trains it.

In: what the config's `lpips` names. Out: weights/lpips_alexnet.safetensors.
"""


rule convert_lpips_weights:
    """Check the published weights of LPIPS on AlexNet (BSD) by their digest, and keep them as safetensors."""
    input:
        lambda wildcards: locate_weights(config["lpips"]),
    output:
        weights=paths.LPIPS_WEIGHTS,
    log:
        "<logs>/weights/convert_lpips_weights.log",
    benchmark:
        "<benchmarks>/weights/convert_lpips_weights.tsv"
    params:
        source=code_of("convert_lpips_weights"),
    script:
        "../scripts/convert_lpips_weights.py"


localrules:
    convert_lpips_weights,  # seconds
