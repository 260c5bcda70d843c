"""The core in every instruction set that this processor has; where no core was built its tests are left out."""

import pytest

from dav_gswt.raster import backends

OF_THE_CORE = ["test_core_memory.py", "test_oracle.py", "test_rasterizer.py"]
collect_ignore = OF_THE_CORE if backends.explain_unavailable("cpu") else []  # test_choice_of_backend.py says so


@pytest.fixture(params=[] if backends.explain_unavailable("cpu") else backends.load_backend("cpu").instruction_sets())
def isa(request):
    return request.param


@pytest.fixture
def raster(isa):
    return backends.load_backend("cpu").Rasterizer(instruction_set=isa)


@pytest.fixture(params=["plain", "antialiased"])
def either(request, isa):
    """A rasterizer of either mode."""
    return backends.load_backend("cpu").Rasterizer(antialiased=request.param == "antialiased", instruction_set=isa)
