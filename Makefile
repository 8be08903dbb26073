# formiga_bt: the commands of a checkout. Needs only Python 3.11+, git and make; everything else goes into .venv (by uv, if it is there).
#
#   make demo     see a small fleet work through missions in simulation
#   make test     run the tests            (make test EXTERNAL=1: also those that need more than pip installs)
#   make lint     formatting, lint, types, import directions
#   make bench    run the benchmarks           (make bench-peers: only those beside other engines, all sizes, some minutes)
#   make pictures draw the pictures of the documents anew

PYTHON ?= python3
EXTERNAL ?=
PYTEST_ARGS ?=
WORKERS ?= 4

VENV := .venv
PY := $(VENV)/bin/python
# What is in the environment: BASE = formiga_bt alone (enough for the demo), STAMP = also what tests need.
BASE := $(VENV)/.base-from-pyproject
STAMP := $(VENV)/.made-from-pyproject

# Compiled modules are kept, though the caller's environment says otherwise: without them each command and each
# worker of the tests compiles all modules anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo test external lint format bench bench-peers pictures wheel clean

help:
	@sed -n 's/^#   //p' Makefile

# uv, where it is installed, makes the environment and installs; what it cannot do (an index that only pip is told of) pip does.
define environment
@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
  echo "formiga_bt needs Python 3.11 or newer, and '$(PYTHON)' is not: install it, or say make PYTHON=/path/to/python3.12" >&2; exit 1; }
@$(PY) -m pip --version >/dev/null 2>&1 || { \
  echo "making $(VENV)"; rm -rf $(VENV); \
  { command -v uv >/dev/null && uv venv --quiet --seed --python "$$(command -v $(PYTHON))" $(VENV) 2>/dev/null; } || \
  { rm -rf $(VENV); $(PYTHON) -m venv $(VENV) >/dev/null 2>&1; } || { rm -rf $(VENV); \
    echo "$(PYTHON) cannot make a virtual environment: install its venv module (Debian, Ubuntu: apt install python3-venv)" >&2; \
    exit 1; }; }
endef
# $(install) WHAT: "$$@" takes it whole, because a comma would end an argument of make's own call.
install = install() { { command -v uv >/dev/null && uv pip install --quiet --compile-bytecode --python $(PY) "$$@" 2>/dev/null; } || \
  $(PY) -m pip install --quiet --disable-pip-version-check "$$@"; }; install

$(BASE): pyproject.toml
	$(environment)
	@echo "installing formiga_bt into $(VENV)"
	@$(install) --editable .
	@touch $@

$(STAMP): pyproject.toml
	$(environment)
	@echo "installing formiga_bt and its tools into $(VENV)"
	@$(install) --editable '.[dev]'
	@touch $(BASE) $@

demo: $(if $(wildcard $(STAMP)),$(STAMP),$(BASE))
	@$(VENV)/bin/formiga demo

# EXTERNAL=1 runs everything in one go, and a test that says it cannot run then fails (tests/conftest.py).
# Twice as many workers as two cores: end-to-end tests wait most of their time, and others compute meanwhile.
# Tests that are not compiled yet are compiled once before, not by each worker.
test: $(STAMP) $(if $(EXTERNAL),external)
	@ls tests/__pycache__/conftest.*-pytest-*.pyc >/dev/null 2>&1 || $(PY) -m pytest --collect-only -qq >/dev/null || true
	@FORMIGA_EXTERNAL=$(EXTERNAL) $(PY) -m pytest -n $(WORKERS) --dist worksteal -m '$(if $(EXTERNAL),,not external)' $(PYTEST_ARGS)

# What tests marked `external` need of pip; Node.js, npm, graphviz and tmux are the machine's (.ci/run installs them).
external: $(STAMP)
	@$(install) --editable '.[dev,btcpp,peers,local-llm,experiments,postgres,parquet]'
	@command -v npm >/dev/null || { echo "tests marked external need Node.js and npm (Debian, Ubuntu: apt install nodejs npm)" >&2; exit 1; }
	@command -v dot >/dev/null || { echo "tests marked external need graphviz (Debian, Ubuntu: apt install graphviz)" >&2; exit 1; }
	@command -v postgres >/dev/null || ls /usr/lib/postgresql/*/bin/postgres >/dev/null 2>&1 || { echo "tests marked external need PostgreSQL (Debian, Ubuntu: apt install postgresql)" >&2; exit 1; }
	@command -v tmux >/dev/null || { echo "tests marked external need tmux (Debian, Ubuntu: apt install tmux)" >&2; exit 1; }

lint: $(STAMP)
	$(PY) -m ruff format --check .
	$(PY) -m ruff check .
	$(PY) -m mypy
	$(VENV)/bin/lint-imports --no-cache

format: $(STAMP)
	$(PY) -m ruff format .
	$(PY) -m ruff check --fix .

bench: $(STAMP)
	@set -e; for file in benchmarks/bench_*.py; do \
	  if [ -e "$$file" ]; then echo "== $$file"; $(PY) "$$file"; else echo "no benchmarks yet"; fi; done

# Writes tables, JSON and a plot to benchmarks/results/. Let nothing else run meanwhile.
bench-peers: $(STAMP)
	@$(install) --editable '.[dev,btcpp,peers]'
	@$(PY) benchmarks/bench_peers.py --full
	@$(PY) benchmarks/bench_reaction.py
	@$(PY) benchmarks/bench_leak.py

pictures: $(STAMP)
	@set -e; for file in docs/pictures/make_*.py; do $(PY) "$$file"; done

wheel: $(STAMP)
	$(PY) -m build --wheel

clean:
	rm -rf $(VENV) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
