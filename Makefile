# Every target sets itself up: a clone, make and a Python >= 3.11 are enough.
PYTHON ?= python3
UV ?= uv
JOBS ?= auto
ARGS ?=

BIN := .venv/bin
BENCH := .venv-bench/bin
PIP_QUIET := --quiet --disable-pip-version-check
COMPILE := $(UV) pip compile pyproject.toml --universal --python-version 3.11 \
	--generate-hashes --custom-compile-command "make lock" --quiet

.DEFAULT_GOAL := help
.PHONY: help venv demo test slow lint format types contracts docs bench lock clean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' Makefile

venv: .venv/installed  ## make .venv with the locked dependencies and hdcal itself

demo: .venv/installed  ## calibrate the bundled gear and say where the report is
	$(BIN)/hdcal calibrate datasets/xb1-100-80 --out demo-out --force
	@echo "The report: demo-out/report.html"

test: .venv/installed  ## all tests but the long statistical ones
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile --benchmark-disable $(ARGS)

slow: .venv/installed  ## the long statistical tests
	$(BIN)/python -m pytest -m slow $(ARGS)

lint: .venv/installed  ## style and formatting
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

format: .venv/installed  ## mend what lint finds, where that is mechanical
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

types: .venv/installed  ## static types
	$(BIN)/pyright --pythonpath $(BIN)/python

contracts: .venv/installed  ## who may import whom
	$(BIN)/lint-imports --no-cache

docs: .venv/installed  ## the documentation, in docs/_build/html
	$(BIN)/sphinx-build -W --keep-going -q -b html docs docs/_build/html
	@echo "The documentation: docs/_build/html/index.html"

bench: .venv-bench/installed  ## compare speed and answers with other tools
	$(BENCH)/python -m benchmarks $(ARGS)

lock:  ## pin the dependencies anew (needs uv)
	$(COMPILE) --extra dev --extra docs --output-file requirements.lock
	$(COMPILE) --extra bench --constraint requirements.lock \
		--output-file requirements-bench.lock

clean:  ## remove everything that these targets made
	rm -rf .venv .venv-bench demo-out dist docs/_build .benchmarks
	rm -rf .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find src tests benchmarks examples docs -name __pycache__ -prune -exec rm -rf {} +

# Without build isolation: the build backend is locked too, nothing else is fetched.
.venv/installed: requirements.lock pyproject.toml
	@echo "Setting up .venv (a minute or so) ..."
	@$(PYTHON) -c 'import sys; sys.version_info >= (3, 11) or sys.exit("hdcal needs Python 3.11 or newer: make PYTHON=python3.12 ...")'
	@$(PYTHON) -m venv --clear .venv
	@$(BIN)/python -m pip install $(PIP_QUIET) --require-hashes -r requirements.lock
	@$(BIN)/python -m pip install $(PIP_QUIET) --no-deps --no-build-isolation -e .
	@touch $@

.venv-bench/installed: requirements-bench.lock pyproject.toml
	@echo "Setting up .venv-bench (a few minutes) ..."
	@$(PYTHON) -m venv --clear .venv-bench
	@$(BENCH)/python -m pip install $(PIP_QUIET) --require-hashes -r requirements-bench.lock
	@$(BENCH)/python -m pip install $(PIP_QUIET) --no-deps --no-build-isolation -e .
	@touch $@
