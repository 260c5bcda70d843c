"""The command line: `dav-gswt`, and what `make run` and `make view` call."""
