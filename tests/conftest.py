"""The tests of the product."""

pytest_plugins = ["fixtures.session", "fixtures.workflow_runs"]
