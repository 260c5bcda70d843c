# Each target sets the environment up if it is missing. `make help` lists them.
SCENE ?=
PHOTOS ?=
PRESET ?=
CORES ?= 2
PORT ?= 8000
WORKERS ?= 2
EXAMPLES ?= 2000
SEED ?= 0
COUNT ?= 20
PYTHON ?= python3
# Threads that wait sleep: other jobs use the processors too.
export OMP_WAIT_POLICY ?= PASSIVE
BIN := .venv/bin

.PHONY: help setup reference run view test test-all lint lint-code lint-types lint-viewer lint-docs mutants \
  bench docs compiler sanitize fuzz
.DELETE_ON_ERROR:

ifneq ($(filter run view,$(MAKECMDGOALS)),)
  WORDS := $(filter-out run view,$(MAKECMDGOALS))
  ifneq ($(WORDS),)
    $(error For photos of your own type: make run PHOTOS=$(firstword $(WORDS)))
  endif
  ifneq ($(if $(PHOTOS),,$(PRESET)),)
    $(error PRESET needs PHOTOS=...; a scene's preset is the key `preset` of the scene)
  endif
endif

help:
	@echo "make run                  a terrain of a small synthetic desert; SCENE=name for another scene of config/scenes"
	@echo "make run PHOTOS=folder    a terrain of your photos, a video or a splat, in ./folder-terrain;"
	@echo "                          PRESET=draft (fast), standard (default) or reference (sharp)"
	@echo "make view                 walk over it in a browser; SCENE and PHOTOS as above, PORT=8000"
	@echo "make setup                the environment alone (.venv); CORES=2 limits the processors of a run"
	@echo "make test, test-all       what people use; also slow tests"
	@echo "make lint, docs, bench    style and types; the documentation as a site; benchmarks"

# .venv alone
setup: .venv/installed

run: .venv/installed
	@$(if $(PHOTOS),$(BIN)/dav-gswt make --cores $(CORES) $(if $(PRESET),--preset $(PRESET)) "$(PHOTOS)",\
	  $(BIN)/python -m dav_gswt.cli.run --cores $(CORES) $(if $(SCENE),--scene $(SCENE)))

view: .venv/installed
	@$(if $(PHOTOS),$(BIN)/dav-gswt view --port $(PORT) "$(PHOTOS)",\
	  $(BIN)/python -m dav_gswt.cli.run --view --port $(PORT) $(if $(SCENE),--scene $(SCENE)))

# A worker takes a whole module, since its tests share what they look at.
PYTEST := $(BIN)/python -m pytest -n $(WORKERS) --dist loadscope --no-loadscope-reorder --durations 20 $(PYTEST_OPTIONS)

# about 5 minutes: everything that people use
test: .venv/installed-test
	@$(PYTEST) $(TESTS)

# about 20 minutes: also interrupted runs, Slurm, Firefox, real photos, fuzzing
test-all: .venv/installed-test
	@$(PYTEST) -m "" $(TESTS)

# formatters, linters, types, the documentation; all of them, also if one fails
lint: .venv/installed-test
	@$(MAKE) --no-print-directory --keep-going --jobs $(WORKERS) lint-types lint-code lint-viewer lint-docs

CORE := $(wildcard workflow/lib/dav_gswt/raster/core/*.cpp workflow/lib/dav_gswt/raster/core/*.h)

lint-code:
	@$(BIN)/ruff check --quiet .
	@$(BIN)/ruff format --check --quiet .
	@$(BIN)/snakefmt --check Snakefile rules 2>/dev/null
	@$(BIN)/clang-format --dry-run -Werror $(CORE)
	@$(BIN)/lint-imports --no-cache >.venv/lint-imports.log || { cat .venv/lint-imports.log; exit 1; }

lint-types:
	@$(BIN)/pyright --level error

lint-viewer:
	@cd tests/browser && npm install --no-save --no-audit --no-fund --silent && npm run --silent lint && npm run --silent types

lint-docs:
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet --site-dir .venv/site
	@! grep -rlE '<(script|link|img)[^>]+(src|href)="?https?:' .venv/site --include=*.html # pages load nothing from a network

# hours: COUNT deliberate faults, drawn by SEED, each tested by `make test`, survivors by `make test-all`
mutants: .venv/installed-test
	@$(BIN)/python tests/mutants --seed $(SEED) --count $(COUNT)

# minutes: the rasterizer's tests on a core built with AddressSanitizer and UBSan, then on one with ThreadSanitizer
sanitize: .venv/installed-test
	@tests/sanitizers/run.sh

# minutes: inputs that are damaged or ill meant, EXAMPLES of each kind by SEED; the table is in results/fuzz.md
fuzz: .venv/installed-test
	@mkdir -p results
	@FUZZ_EXAMPLES=$(EXAMPLES) FUZZ_SEED=$(SEED) FUZZ_TABLE=results/fuzz.md \
	  $(BIN)/python -m pytest tests/fuzz -m "" --hypothesis-seed=$(SEED) -q && cat results/fuzz.md

bench: .venv/installed-test
	@for bench in benchmarks/*.py; do PYTHONPATH=tests:tests/browser $(BIN)/python $$bench || exit 1; done

# the documentation as a site in site/; a warning is an error
docs: .venv/installed-docs
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

# docs/reference/policies.md and the schemas: made from the models
reference: .venv/installed
	@$(BIN)/python workflow/reference.py

SOURCES := pyproject.toml requirements.lock $(wildcard workflow/lib/dav_gswt/raster/core/*)
# a set-up that had to do without a compiler is done again as soon as there is one
AGAIN := $(if $(wildcard .venv/without-core),$(shell $(PYTHON) workflow/prepare.py core && echo compiler))
INSTALL := $(BIN)/pip install --quiet --disable-pip-version-check

# torch first and alone: pinned, so that nothing that asks for a plain torch brings another build of it
.venv/installed: $(SOURCES) $(AGAIN)
	@$(PYTHON) workflow/prepare.py
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@echo "Setting up .venv (once; some minutes)"
	@$(INSTALL) "$$(grep -m1 ^torch== requirements.lock)"
	@$(INSTALL) -r requirements.lock
	@if $(PYTHON) workflow/prepare.py core; then \
	  $(INSTALL) --no-build-isolation --no-deps --editable . && rm -f .venv/without-core; \
	else \
	  $(INSTALL) --no-build-isolation --no-deps --editable . --config-settings=wheel.cmake=false && touch .venv/without-core; \
	fi
	@touch $@

.venv/installed-docs: .venv/installed requirements-docs.lock
	@$(INSTALL) -r requirements-docs.lock
	@touch $@

.venv/installed-test: .venv/installed-docs requirements-test.lock
	@$(INSTALL) -r requirements-test.lock
	@touch $@

# targets of a neighbour that uses this workflow, where it is there
-include study/targets.mk
