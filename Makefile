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
bench: $(VENV)/bench-installed build ## measure speed beside peers (about 15 minutes; the core alone: cargo bench)
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

# What takes minutes. Fuzzing wants a nightly compiler and cargo-fuzz; with no unsafe code there is nothing to sanitize.
FUZZ_SECONDS := 60
.PHONY: soak
soak: build ## tests that take minutes: long runs, forks, interrupts, lifecycles, corrupted documents
	$(BIN)/python -m pytest soak

.PHONY: fuzz
fuzz: ## fuzz documents, steps and states of the core, a minute each
	for target in config state step; do \
	  mkdir -p fuzz/corpus/$$target; \
	  cargo +nightly fuzz run --sanitizer none $$target fuzz/corpus/$$target $$(ls -d fuzz/seeds/$$target 2> /dev/null) -- \
	    -max_total_time=$(FUZZ_SECONDS) -max_len=8192 || exit 1; \
	done

# The package as users get it: a wheel, put into environments that hold other versions or other libraries than .venv
# does. What is in each stands in compat/NAME.in, its pins in compat/NAME.txt; the newest takes NEWEST_PYTHON.
COMPAT := .compat
TOOLS := $(COMPAT)/tools/bin
UV := $(TOOLS)/uv
RELEASES := oldest newest
PEERS := bare rllib supersuit torchrl
NEWEST_PYTHON ?= $(PYTHON)
CONTRACT := conformance copies golden gymnasium_envs parallel_env policy_files readme records sb3 state_files vector_env
WITHOUT_RUST := env -i HOME=$(HOME) PATH=/usr/bin:/bin

$(TOOLS)/installed: compat/tools.txt
	$(PYTHON) -m venv --clear $(COMPAT)/tools
	$(TOOLS)/python -m pip --disable-pip-version-check install --quiet --requirement $<
	touch $@

.PRECIOUS: $(COMPAT)/%/installed
$(COMPAT)/%/installed: compat/%.txt $(TOOLS)/installed
	$(UV) venv --quiet --clear --no-python-downloads --python $(if $(filter newest,$*),$(NEWEST_PYTHON),$(PYTHON)) $(COMPAT)/$*
	$(UV) pip install --quiet --python $(@D)/bin/python --requirement $<
	touch $@

.PHONY: wheel
wheel: $(TOOLS)/installed ## a portable wheel, made from the source distribution beside it, in dist
	rm -rf dist
	PATH=$(CURDIR)/$(TOOLS):$(PATH) $(TOOLS)/maturin build --release --locked --zig --compatibility manylinux2014 --sdist --out dist

.PHONY: compat
compat: $(RELEASES:%=compat-%) $(PEERS:%=compat-%) ## the wheel with oldest and newest dependencies, RLlib, TorchRL, SuperSuit

.PHONY: $(RELEASES:%=compat-%) $(PEERS:%=compat-%)
$(RELEASES:%=compat-%): TESTS = $(CONTRACT:%=tests/test_%.py)
$(PEERS:%=compat-%): TESTS = compat/test_$*.py
$(RELEASES:%=compat-%) $(PEERS:%=compat-%): compat-%: $(COMPAT)/%/installed wheel
	$(UV) pip install --quiet --python $(COMPAT)/$*/bin/python --reinstall --no-deps dist/*.whl
	$(UV) pip check --quiet --python $(COMPAT)/$*/bin/python
	$(WITHOUT_RUST) $(COMPAT)/$*/bin/python -P -m pytest compat/test_wheel.py $(TESTS)

.PHONY: compat-pins
compat-pins: $(TOOLS)/installed ## resolve the pins of `make compat` anew
	$(foreach name,oldest newest bare rllib supersuit torchrl,$(UV) pip compile --quiet --no-header --no-annotate --upgrade \
	  --python-version 3.11 pyproject.toml compat/$(name).in $(if $(filter $(name),$(RELEASES)),--extra train --extra video) \
	  $(if $(filter $(name),oldest),--resolution lowest-direct) --output-file compat/$(name).txt &&) true

# cargo-deny is compiled by the first call (some minutes).
CARGO_DENY := $(COMPAT)/cargo/bin/cargo-deny
$(CARGO_DENY):
	cargo install --quiet --locked --root $(COMPAT)/cargo cargo-deny@0.20.2

.PHONY: audit
audit: $(CARGO_DENY) ## licenses, sources and versions of all crates
	$(CARGO_DENY) --locked check licenses bans sources

.PHONY: advisories
advisories: $(CARGO_DENY) $(TOOLS)/installed ## known faults of crates and Python packages (asks RustSec and PyPI)
	$(CARGO_DENY) --locked check advisories
	$(TOOLS)/pip-audit --requirement constraints.txt --no-deps --disable-pip

.PHONY: format
format: build ## format all code
	cargo fmt --all
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

.PHONY: clean
clean: ## remove what was built, not what was computed
	rm -rf target dist $(COMPAT) $(VENV) flockesc_env/_core*.so
