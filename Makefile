# The few commands that a person types; `make help` lists them.
.DEFAULT_GOAL := help
SHELL := bash -o pipefail
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
DEMO := runs/demo
export VIRTUAL_ENV := $(CURDIR)/$(VENV)
export PATH := $(VIRTUAL_ENV)/bin:$(PATH)

.PHONY: help
help: ## list the commands
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 16

# Dependencies, from the constraints file; again only if what they are made from changes. What builds the package is
# installed before it, and so is rliable, which comes as source that builds only apart from what is here.
$(VENV)/installed: constraints.txt pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(PIP) install --quiet --constraint constraints.txt maturin rliable
	$(PIP) install --constraint constraints.txt --no-build-isolation --editable ".[dev]"
	touch $@

.PHONY: build
build: $(VENV)/installed ## make the virtual environment .venv and build the package into it
	$(BIN)/maturin develop --release --locked --quiet --skip-install

.PHONY: demo
demo: build ## train a range policy and compare it with the grid search (about 4 minutes on 2 cores)
	rm -rf $(DEMO)
	$(BIN)/python -m training train demo-ppo --run $(DEMO)
	$(BIN)/python -m training compare --policies stubborn-leaders $(DEMO) --output $(DEMO)/comparison

$(VENV)/bench-installed: $(VENV)/installed
	$(PIP) install --constraint constraints.txt --no-build-isolation --editable ".[bench]"
	touch $@

.PHONY: bench
bench: $(VENV)/bench-installed build ## measure speed beside peers (about 9 minutes; the core alone: cargo bench)
	$(BIN)/python -m benchmarks run

.PHONY: paper
paper: build ## reproduce the paper: every figure, every claim beside its measurement (about 6 minutes)
	$(BIN)/flockesc paper --output results/paper --page docs/paper.md

.PHONY: worlds
worlds: build ## the best fixed range in every flock preset (about 35 minutes)
	$(BIN)/flockesc worlds --output results/worlds --page docs/worlds.md

.PHONY: test
test: lint test-rust test-python ## everything that must pass before a change lands

.PHONY: lint
lint: build ## formatters, linters, types, stubs
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --locked --quiet -- --deny warnings
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest flockesc_env._core

.PHONY: test-rust
test-rust: ## tests of the core crate
	cargo test --locked

.PHONY: test-python
test-python: build ## tests of the Python package
	$(BIN)/python -m pytest

.PHONY: format
format: build ## format all code
	cargo fmt --all
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

.PHONY: clean
clean: ## remove what was built, not what was computed
	rm -rf target $(VENV) flockesc_env/_core*.so
