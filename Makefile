# Everything runs in .venv, which the targets make themselves. What they need beforehand is checked by .ci/needs before anything
# is downloaded (PYTHON=... to choose an interpreter).
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

PYTHON ?= python3
BIN := .venv/bin
STAMPS := .venv/stamps
RUST := Cargo.toml Cargo.lock $(shell find crates -name '*.rs' -o -name Cargo.toml)
# clippy and cargo look at the interpreter that the extension is built for.
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python
# Messages and tables must not depend on who runs this.
export NO_COLOR := 1
export NO_MKDOCS_2_WARNING := 1
DEMO := build/demo
BENCH := .venv-bench
# What `make bench` hands to benchmarks/run.py, such as OPTIONS="--only W1 W6" or OPTIONS=--quick.
OPTIONS ?=
SECONDS ?= 600
SEED ?= 0

.PHONY: help needs build demo test quick fuzz verify lint lint-rust lint-python check-rust check-python test-machines bench bench-core docs serve-docs format clean

help:  ## say what there is
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 22

# Prerequisites inherit this: what is not found stops a target before its first download.
test quick lint lint-rust lint-python check-rust check-python test-machines docs serve-docs format: NEEDS := test

needs:
	@PYTHON='$(or $(wildcard $(BIN)/python),$(PYTHON))' .ci/needs $(NEEDS)

build: $(STAMPS)/build  ## compile the core and install jointplay in .venv

demo: $(STAMPS)/build  ## the bundled four-bar: its error under the load, worst and random, and the corrected drives
	@rm -rf $(DEMO) && mkdir -p $(DEMO)
	cd $(DEMO) && ../../$(BIN)/jointplay new four-bar
	cd $(DEMO) && ../../$(BIN)/jointplay error four-bar.toml
	cd $(DEMO) && ../../$(BIN)/jointplay compensate four-bar.toml

test: lint check-rust check-python docs  ## everything that CI runs

lint: lint-rust lint-python  ## formats, linters, types, stubs

lint-rust: $(STAMPS)/venv
	cargo fmt --all --check
	cargo clippy --locked --workspace --all-targets -- -D warnings

lint-python: $(STAMPS)/build $(STAMPS)/develop
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	MYPYPATH=python $(BIN)/stubtest jointplay._core

check-rust: | needs
	cargo test --locked

check-python: $(STAMPS)/build $(STAMPS)/develop
	$(BIN)/python -m pytest -n auto --dist worksteal

quick: $(STAMPS)/build $(STAMPS)/develop  ## less of the Python tests: a thirtieth of the time for each function
	$(BIN)/python -m pytest -n auto --dist worksteal --budget 0.1

fuzz: $(STAMPS)/build $(STAMPS)/develop  ## damaged and unusual files in every command, random commands, damaged maps, signals, for SECONDS=600 from SEED=0
	cd tests && ../$(BIN)/python -m helpers.fuzz --seconds $(SECONDS) --seed $(SEED)

# Each line stands for a machine: the kernels of BLAS, the functions of the C library, registers and threads of the core.
# SLICE="tests/analyses/test_worst.py -k four_bar" runs less.
SLICE ?=
OTHERS := \
  "OPENBLAS_CORETYPE=Prescott JOINTPLAY_WIDTH=plain RAYON_NUM_THREADS=1 LC_ALL=C COLUMNS=40" \
  "OPENBLAS_CORETYPE=Haswell JOINTPLAY_WIDTH=avx2 RAYON_NUM_THREADS=7 TZ=Asia/Kathmandu" \
  "OPENBLAS_CORETYPE=Zen JOINTPLAY_WIDTH=avx2 RAYON_NUM_THREADS=2 GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F"

test-machines: $(STAMPS)/build $(STAMPS)/develop  ## the Python tests as on other processors, with other threads, locales and terminals
	for other in $(OTHERS); do \
	    echo "$$other"; \
	    env $$other $(BIN)/python -m pytest -q -n auto --dist worksteal $(SLICE); \
	done

# One that fails does not keep the others from being measured.
verify: $(STAMPS)/build $(STAMPS)/develop  ## all cases of all tests, then every tests/verify_*.py: independent engines and long measurements; writes docs/verification.json and the tables of docs/checks.md
	failed=; $(BIN)/python -m pytest -n auto --dist worksteal --budget inf || failed+=" tests"; for program in tests/verify_*.py; do \
	    echo "$$program: $$(sed -n '1s/^"""\(.*\)$$/\1/p' $$program)"; \
	    $(BIN)/python $$program || failed+=" $$program"; \
	done; test -z "$$failed" || { echo "failed:$$failed" >&2; exit 1; }

bench: $(BENCH)/stamp bench-core  ## jointplay side by side with other programs; rewrites the tables of docs/benchmarks.md
	$(BENCH)/bin/python benchmarks/run.py $(OPTIONS)

bench-core: $(BENCH)/stamp  ## the core alone, mechanism by mechanism
	$(BENCH)/bin/python benchmarks/specs.py
	cargo bench --locked --package jointplay-core -- --quiet

docs: $(STAMPS)/build $(STAMPS)/develop  ## build the documentation in site/, warnings are errors
	$(BIN)/mkdocs build --strict # not --quiet, which also silences the warnings that strict counts

serve-docs: $(STAMPS)/build $(STAMPS)/develop  ## the documentation on this machine, rebuilt while you write
	$(BIN)/mkdocs serve

format: $(STAMPS)/develop  ## put all sources into their format, write what is made of the schema
	cargo fmt --all
	$(BIN)/python tests/helpers/signatures.py
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

clean:  ## remove everything that was made
	rm -rf .venv .venv-bench target site build python/jointplay/_core*.so .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find python tests examples -name __pycache__ -prune -exec rm -rf {} +

$(STAMPS)/venv: | needs
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1' 'maturin>=1.9,<2'
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/build: $(STAMPS)/venv pyproject.toml $(RUST)
	$(BIN)/maturin develop --quiet --locked --release --extras plot,tables
	@touch $@

# The peers have an environment of their own: none of them is needed to use or to test jointplay.
$(BENCH)/stamp: benchmarks/requirements.txt pyproject.toml $(RUST) | needs
	test -x $(BENCH)/bin/python || $(PYTHON) -m venv $(BENCH)
	$(BENCH)/bin/python -m pip install --quiet --requirement benchmarks/requirements.txt
	PYO3_PYTHON=$(CURDIR)/$(BENCH)/bin/python VIRTUAL_ENV=$(CURDIR)/$(BENCH) $(BENCH)/bin/maturin develop --quiet --locked --release
	@touch $@

$(STAMPS)/develop: $(STAMPS)/build pyproject.toml
	$(BIN)/python -m pip install --quiet --group test --group lint --group docs
	@touch $@
