"""The core in every instruction set that this processor has."""

import pytest

from dav_gswt.raster import cpu


@pytest.fixture(params=cpu.instruction_sets())
def isa(request):
    return request.param


@pytest.fixture
def raster(isa):
    return cpu.Rasterizer(instruction_set=isa)
