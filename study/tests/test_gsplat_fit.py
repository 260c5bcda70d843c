"""The comparison with gsplat's trainer can be imported beside the real gsplat."""

from importlib import import_module

import pytest

pytest.importorskip("gsplat", reason="gsplat is not installed: pip install gsplat, on a machine with an NVIDIA GPU")


def test_the_trainer_can_be_imported():
    assert import_module("dav_gswt_study.gsplat_fit")
