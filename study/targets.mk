# Targets of the study, which the project's Makefile includes.
STUDY := PYTHONPATH=study:tests:workflow $(BIN)/python
.PHONY: test-study lint-study docs-study claims prior

# about 15 minutes: the tests of the study
test-study: .venv/installed-test
	@$(PYTEST) -m "" --jaxtyping-packages=dav_gswt_study,beartype.beartype $(or $(TESTS),study/tests)

lint: lint-study

lint-study: lint-viewer # which installs biome and TypeScript
	@$(BIN)/snakefmt --check study/Snakefile study/rules 2>/dev/null
	@PYTHONPATH=study:tests $(BIN)/pyright --level error --project study
	@cd tests/browser && node_modules/.bin/biome lint --error-on-warnings --config-path=../../study/checks ../../study/forced_choice
	@tests/browser/node_modules/.bin/tsc --project study/checks/tsconfig.json

docs: docs-study

# study/docs/config.md: the keys of study/config.yaml, from the config models
docs-study: .venv/installed
	@$(STUDY) -m dav_gswt_study.config_reference

# study/docs/results/claims.md, from the tables of study/docs/data
claims: .venv/installed
	@$(STUDY) -m dav_gswt_study.claims

# hours: the weights that come with the project were made so
prior: .venv/installed
	@$(BIN)/snakemake -s study/Snakefile --cores $(CORES) -- study/results/prior/terrain.safetensors
