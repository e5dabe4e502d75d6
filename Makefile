# Everything runs in .venv, which the targets make themselves. Needed beforehand: Python >= 3.11 (PYTHON=... to choose one),
# Rust with rustfmt and clippy, a C and a C++ compiler.
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

.PHONY: help build demo test lint lint-rust lint-python check-rust check-python verify bench bench-core docs serve-docs format clean

help:  ## say what there is
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 22

build: $(STAMPS)/build  ## compile the core and install jointplay in .venv

demo: $(STAMPS)/build  ## the bundled four-bar: its error in all four questions, and the corrected drives
	@rm -rf $(DEMO) && mkdir -p $(DEMO)
	cd $(DEMO) && ../../$(BIN)/jointplay new four-bar
	cd $(DEMO) && ../../$(BIN)/jointplay error four-bar.toml
	cd $(DEMO) && ../../$(BIN)/jointplay compensate four-bar.toml

verify: $(STAMPS)/build $(STAMPS)/develop  ## long checks against independent solutions; docs/checks.md has their tables
	$(BIN)/python tests/verify_loaded.py

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

check-rust:
	cargo test --locked

check-python: $(STAMPS)/build $(STAMPS)/develop
	$(BIN)/python -m pytest -n auto --dist worksteal

bench: $(BENCH)/stamp bench-core  ## jointplay side by side with other programs; rewrites the tables of docs/benchmarks.md
	$(BENCH)/bin/python benchmarks/run.py $(OPTIONS)

bench-core: $(BENCH)/stamp  ## the core alone, mechanism by mechanism
	$(BENCH)/bin/python benchmarks/specs.py
	cargo bench --locked --package jointplay-core -- --quiet

docs: $(STAMPS)/build $(STAMPS)/develop  ## build the documentation in site/, warnings are errors
	$(BIN)/mkdocs build --strict # not --quiet, which also silences the warnings that strict counts

serve-docs: $(STAMPS)/build $(STAMPS)/develop  ## the documentation on this machine, rebuilt while you write
	$(BIN)/mkdocs serve

format: $(STAMPS)/develop  ## put all sources into their format
	cargo fmt --all
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

clean:  ## remove everything that was made
	rm -rf .venv .venv-bench target site build python/jointplay/_core*.so .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find python tests examples -name __pycache__ -prune -exec rm -rf {} +

$(STAMPS)/venv:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "jointplay needs Python 3.11 or newer: make PYTHON=python3.x" >&2; exit 1; }
	@command -v cargo > /dev/null || { echo "jointplay needs Rust: no cargo on the PATH" >&2; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1' 'maturin>=1.9,<2'
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/build: $(STAMPS)/venv pyproject.toml $(RUST)
	$(BIN)/maturin develop --quiet --locked --release --extras plot
	@touch $@

# The peers have an environment of their own: none of them is needed to use or to test jointplay.
$(BENCH)/stamp: benchmarks/requirements.txt pyproject.toml $(RUST)
	test -x $(BENCH)/bin/python || $(PYTHON) -m venv $(BENCH)
	$(BENCH)/bin/python -m pip install --quiet --requirement benchmarks/requirements.txt
	PYO3_PYTHON=$(CURDIR)/$(BENCH)/bin/python VIRTUAL_ENV=$(CURDIR)/$(BENCH) $(BENCH)/bin/maturin develop --quiet --locked --release
	@touch $@

$(STAMPS)/develop: $(STAMPS)/build pyproject.toml
	$(BIN)/python -m pip install --quiet --group test --group lint --group docs
	@touch $@
