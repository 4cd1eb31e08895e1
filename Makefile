# Two commands do everything on a fresh machine with Python 3.11+, pip and make: `make demo` and `make test`.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test bench slow hidden clean

demo: $(READY)
	$(BIN)/mckibben demo

test: $(READY)
	$(BIN)/ruff check .
	$(BIN)/basedpyright
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

slow: $(READY)
	$(BIN)/python -m pytest -m slow

# The hidden-effect benchmark: a share of its plan (1 is all of its 8661 cases); a stopped study goes on.
SHARE ?= 0.1
WORKERS ?= 2
hidden: $(READY)
	$(BIN)/python -m tests.hidden.study --share $(SHARE) --workers $(WORKERS) --out build/hidden.jsonl

# Mutation testing: a fixed sample of mutants, judged by the tests that cover them; a stopped run goes on.
.PHONY: mutants
mutants: $(READY)
	$(BIN)/python -m tests.mutants --sample 300 --seed 1

bench: $(READY)
	$(BIN)/python -m pytest tests/benchmarks --benchmark-only

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable '.[test,notebooks]' --constraint constraints.txt
	touch $(READY)

clean:
	rm -rf $(VENV) build dist .pytest_cache .ruff_cache .hypothesis

# Wheel and source archive into dist/: the same bytes from the same sources.
.PHONY: wheel docs
wheel: $(READY)
	$(BIN)/python -m hatchling build -d dist

# The documentation into build/site, every link checked; opens from disk. The notebooks for people who start are run (minutes).
WORKED := $(patsubst notebooks/%.py,build/notebooks/%.ipynb,$(wildcard notebooks/[0-9]_*.py))
docs: $(READY) $(WORKED)
	$(BIN)/python -m pip install --quiet --editable '.[docs]' --constraint constraints.txt
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet --config-file notebooks/site/mkdocs.yml

build/notebooks/%.ipynb: notebooks/%.py $(READY)
	mkdir -p build/notebooks
	$(BIN)/marimo export ipynb $< --include-outputs --sort top-down --force --output $@
