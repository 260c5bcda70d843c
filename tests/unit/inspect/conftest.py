"""A made-up scene, and whether this machine draws off screen."""

import pytest
from fixtures import result_tree

from dav_gswt.errors import InputError

pytest.importorskip("pyvista", reason="the extra inspect is not installed")
pytest.importorskip("trame_vtk", reason="the extra inspect is not installed")


@pytest.fixture(scope="session")
def drawable():
    """Skips where nothing can be drawn off screen."""
    from dav_gswt.inspect import plot

    try:
        plot.require_rendering()
    except InputError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def tree(tmp_path_factory) -> result_tree.Tree:
    """Tests leave it as it is."""
    return result_tree.write(tmp_path_factory.mktemp("inspect") / "results" / "sample_ground")
