# Each target sets the environment up if it is missing. `make run SCENE=name CORES=4` for another scene or machine.
SCENE ?=
CORES ?= 2
PORT ?= 8000
PYTHON ?= python3
BIN := .venv/bin

.PHONY: run view test bench
.DELETE_ON_ERROR:

run: .venv/installed
	@$(BIN)/python -m dav_gswt.run --cores $(CORES) $(if $(SCENE),--scene $(SCENE))

view: .venv/installed
	@$(BIN)/python -m dav_gswt.run --view --port $(PORT) $(if $(SCENE),--scene $(SCENE))

test: .venv/installed-test
	@$(BIN)/python -m pytest $(TESTS)

bench: .venv/installed-test
	@for bench in benchmarks/*.py; do PYTHONPATH=tests:tests/browser $(BIN)/python $$bench || exit 1; done

SOURCES := pyproject.toml requirements.lock $(wildcard workflow/lib/dav_gswt/raster/core/*)

# torch first and alone: pinned, so that nothing that asks for a plain torch brings another build of it
.venv/installed: $(SOURCES)
	@$(PYTHON) workflow/prepare.py
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@echo "Setting up .venv (once; some minutes)"
	@$(BIN)/pip install --quiet --disable-pip-version-check "$$(grep -m1 ^torch== requirements.lock)"
	@$(BIN)/pip install --quiet --disable-pip-version-check -r requirements.lock
	@$(BIN)/pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --editable .
	@touch $@

.venv/installed-test: .venv/installed requirements-test.lock
	@$(BIN)/pip install --quiet --disable-pip-version-check -r requirements-test.lock
	@touch $@
