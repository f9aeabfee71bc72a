# The few commands that a person types; `make help` lists them.
.DEFAULT_GOAL := help
SHELL := bash -o pipefail
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
UV := $(BIN)/uv
INSTALL := $(UV) pip install --quiet --constraint constraints.txt --requirement pyproject.toml
# With why tests were skipped: how to get a browser, say.
PYTEST := $(BIN)/python -m pytest --numprocesses auto -rs
DEMO := runs/demo
export VIRTUAL_ENV := $(CURDIR)/$(VENV)
export PATH := $(VIRTUAL_ENV)/bin:$(PATH)

.PHONY: help
help: ## list the commands
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 16

# The one thing that pip installs; uv installs the rest.
$(UV):
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip --disable-pip-version-check install --quiet --constraint constraints.txt uv

# Cargo's `dev` compiles in seconds after an edit and shares its crates with the tests; `release` is what users get, and
# some per cent faster. Results are the same bits.
PROFILE := dev
.PHONY: build
build: $(UV) ## make the virtual environment .venv and build the package into it
	$(INSTALL) --extra dev
	$(BIN)/maturin develop --uv --profile $(PROFILE) --locked --quiet

.PHONY: demo
demo: build ## train a range policy and compare it with the grid search (about 4 minutes on 2 cores)
	rm -rf $(DEMO)
	$(BIN)/python -m training train demo-ppo --run $(DEMO)
	$(BIN)/python -m training compare --policies stubborn-leaders $(DEMO) --output $(DEMO)/comparison

bench paper robustness: PROFILE := release

.PHONY: bench
bench: build ## measure speed beside peers (about 15 minutes; the core alone: cargo bench --package flockesc-kernels)
	$(INSTALL) --extra bench
	$(BIN)/python -m benchmarks run

.PHONY: paper
paper: build ## reproduce the paper: every figure, every claim beside its measurement (about 6 minutes)
	$(BIN)/python -m studies paper --output results/paper --page docs/paper.md

.PHONY: robustness
robustness: build ## the best fixed range in every flock preset (about 35 minutes)
	$(BIN)/python -m studies robustness --output results/robustness --page docs/robustness.md

.PHONY: test
test: lint test-rust test-python ## what must pass before a change lands

.PHONY: test-all
test-all: test ## the tests that take minutes, too: long runs, forks, interrupts, lifecycles, corrupted documents, Ray
	$(INSTALL) --extra ray
	$(PYTEST) tests/slow

.PHONY: lint
lint: build ## formatters, linters, types, stubs
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --locked --quiet -- --deny warnings
	RUSTDOCFLAGS="--deny warnings" cargo doc --workspace --no-deps --locked --quiet
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest flockesc_env._core

# The bindings have no Rust tests; naming them lets the tests use the crates that `make build` has compiled.
.PHONY: test-rust
test-rust: $(UV) ## tests of the core crate
	cargo test --locked --package flockesc-core --package flockesc-py

.PHONY: test-python
test-python: build ## tests of the Python package
	$(PYTEST)

# Fuzzing wants a nightly compiler and cargo-fuzz; with no unsafe code there is nothing to sanitize.
FUZZ_SECONDS := 60
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
RELEASES := oldest newest
PEERS := bare rllib supersuit torchrl
ENVIRONMENTS := $(RELEASES) $(PEERS)
NEWEST_PYTHON ?= $(PYTHON)
CONTRACT := envs/test_{conformance,copies,gymnasium,pettingzoo,sb3,states,vector_env}.py model/test_golden.py \
  policies/test_policy_files.py tools/test_{readme,records}.py
WITHOUT_RUST := env -i HOME=$(HOME) PATH=/usr/bin:/bin

# Not --locked: the source distribution lacks the crates that only measure, and Cargo drops from its lock what they alone
# need. `make test` holds the lock itself.
.PHONY: wheel
wheel: $(UV) ## a portable wheel, made from the source distribution beside it, in dist
	rm -rf dist
	$(INSTALL) --extra release
	$(BIN)/maturin build --release --zig --compatibility manylinux2014 --sdist --out dist

.PHONY: compat
compat: $(ENVIRONMENTS:%=compat-%) ## the wheel with oldest and newest dependencies, RLlib, TorchRL, SuperSuit

.PHONY: $(ENVIRONMENTS:%=compat-%)
$(RELEASES:%=compat-%): TESTS = $(CONTRACT:%=tests/%)
$(PEERS:%=compat-%): TESTS = compat/test_$*.py
$(ENVIRONMENTS:%=compat-%): compat-%: wheel
	$(UV) venv --quiet --clear --no-python-downloads --python $(if $(filter newest,$*),$(NEWEST_PYTHON),$(PYTHON)) $(COMPAT)/$*
	$(UV) pip install --quiet --python $(COMPAT)/$* --requirement compat/$*.txt
	$(UV) pip install --quiet --python $(COMPAT)/$* --no-deps dist/*.whl
	$(UV) pip check --quiet --python $(COMPAT)/$*
	$(WITHOUT_RUST) $(COMPAT)/$*/bin/python -P -m pytest compat/test_wheel.py $(TESTS)

# The pins of .venv and of `make compat`; UPGRADE= keeps what is pinned and still fits.
UPGRADE := --upgrade
COMPILE = $(UV) pip compile --quiet --no-header --no-annotate $(UPGRADE) --python-version 3.11 pyproject.toml
.PHONY: pins
pins: $(UV) ## resolve all pins from pyproject.toml and compat/*.in
	$(COMPILE) --all-extras --output-file constraints.txt
	$(foreach name,$(ENVIRONMENTS),$(COMPILE) compat/$(name).in $(if $(filter $(name),$(RELEASES)),--extra train --extra video) \
	  $(if $(filter $(name),oldest),--resolution lowest-direct) --output-file compat/$(name).txt &&) true

# Tools that are compiled by the first call (some minutes).
CARGO_TOOLS := $(COMPAT)/cargo/bin
CARGO_DENY := $(CARGO_TOOLS)/cargo-deny
$(CARGO_DENY): VERSION := 0.20.2
$(CARGO_TOOLS)/cargo-mutants: VERSION := 27.1.0
$(CARGO_TOOLS)/%:
	cargo install --quiet --locked --root $(COMPAT)/cargo $*@$(VERSION)

# Samples: some mutants of the package, one part of the core's.
MUTANTS := 100
SHARD := 0/40
.PHONY: mutants
mutants: build $(CARGO_TOOLS)/cargo-mutants ## change the code in a sample of places, and see whether tests notice (hours)
	$(UV) run --quiet --no-project --isolated --python $(BIN)/python --with cosmic-ray==8.7.0 tests/support/mutants.py $(MUTANTS)
	$(CARGO_TOOLS)/cargo-mutants mutants --package flockesc-core --shard $(SHARD) --output runs

.PHONY: audit
audit: $(CARGO_DENY) ## licenses, sources and versions of all crates
	$(CARGO_DENY) --locked check licenses bans sources

.PHONY: advisories
advisories: $(CARGO_DENY) $(UV) ## known faults of crates and Python packages (asks RustSec and PyPI)
	$(CARGO_DENY) --locked check advisories
	$(INSTALL) --extra release
	$(BIN)/pip-audit --requirement constraints.txt --no-deps --disable-pip

.PHONY: format
format: build ## format all code
	cargo fmt --all
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

.PHONY: clean
clean: ## remove what was built, not what was computed
	rm -rf target dist $(COMPAT) $(VENV) flockesc_env/_core*.so
