# Every target sets itself up: a clone, make and a Python >= 3.11 are enough.
PYTHON ?= python3
UV ?= uv
JOBS ?= auto
ARGS ?=
CASES ?= 310
MIX ?= rigs
ATTACKS ?= 100000
WORKERS ?= 2
PART ?=

BIN := .venv/bin
BENCH := .venv-bench/bin
BLIND := $(BIN)/python -m benchmarks.blind
PIP_QUIET := --quiet --disable-pip-version-check
COMPILE := $(UV) pip compile pyproject.toml --universal --python-version 3.11 \
	--generate-hashes --custom-compile-command "make lock" --quiet

.DEFAULT_GOAL := help
.PHONY: help venv demo test thorough slow lint format types contracts docs bench \
	blind attacks lock clean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-15s %s\n", $$1, $$2 }' Makefile

venv: .venv/installed  ## make .venv with the locked dependencies and hdcal itself

demo: .venv/installed  ## calibrate and diagnose the bundled gear
	$(BIN)/hdcal calibrate datasets/xb1-100-80 --out demo-out --force
	$(BIN)/hdcal diagnose datasets/xb1-100-80 --quick --out demo-verdict --force
	@echo "The reports: demo-out/report.html, demo-verdict/report.html"

test: .venv/installed  ## all tests but the longest ones
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal --benchmark-disable $(ARGS)

thorough: .venv/installed  ## the longer tests beside them; PART=3/8 for a part of them
	$(BIN)/python -m pytest -m thorough -n $(JOBS) --dist worksteal --benchmark-disable \
		$(if $(PART),--part $(PART)) $(ARGS)

slow: .venv/installed  ## the long statistical tests
	$(BIN)/python -m pytest -m slow $(ARGS)

attacks: .venv/installed  ## ATTACKS hostile inputs, each answered or refused (minutes)
	HDCAL_ATTACKS=$(ATTACKS) $(BIN)/python -m pytest -m slow -n $(JOBS) \
		tests/cli/test_attacks.py

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
	$(BIN)/sphinx-build -W -q -b doctest -d docs/_build/doctrees docs docs/_build/doctest
	$(BIN)/sphinx-build -W --keep-going -q -b html -d docs/_build/doctrees docs docs/_build/html
	@echo "The documentation: docs/_build/html/index.html"

bench: .venv-bench/installed  ## compare speed and answers with other tools
	$(BENCH)/python -m benchmarks $(ARGS)

# An interrupted check goes on; answers of two versions are never mixed.
blind: | .venv/installed  ## seal CASES cases, answer them blind, open and score (long)
	@if test -e blind-check/opened.json; then \
		echo "blind-check is opened already. For a new one remove or move both:"; \
		echo "  rm -r blind-check blind-check.key"; exit 1; fi
	@if test -e blind-check; then echo "Going on with blind-check ..."; else \
		$(BLIND) make --cases $(CASES) --mix $(MIX) --out blind-check; fi
	@for name in hdcal bic r2 none; do \
		test -e blind-check/answers-$$name.json || $(BLIND) answer \
			blind-check --by $$name --jobs $(WORKERS) || exit $$?; done
	@$(BLIND) open blind-check --key blind-check.key

lock:  ## pin the dependencies anew (needs uv)
	$(COMPILE) --extra dev --extra docs --output-file requirements.lock
	$(COMPILE) --extra bench --constraint requirements.lock \
		--output-file requirements-bench.lock

clean:  ## remove everything that these targets made
	rm -rf .venv .venv-bench demo-out demo-verdict blind-check blind-check.key
	rm -rf dist docs/_build .benchmarks
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
