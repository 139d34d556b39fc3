# Everything lives in .venv; a stamp there remembers what was installed, and pyproject.toml outdates it.
PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt
DEFINITIONS := pyproject.toml constraints.txt

PART ?=

.PHONY: demo test test-slow test-long test-all notebooks docs pdf versions lint types bench clean

demo: .venv/core.stamp
	$(BIN)/seatrial demo -o demo

# Compiled files are kept, as half of a collection is otherwise the rewriting of assertions.
test test-slow test-long test-all notebooks: export PYTHONDONTWRITEBYTECODE =

test: .venv/test.stamp
	$(BIN)/python tests/shares.py -m "not slow and not long"

# What takes more than a tenth of a second each, most of it fits and compilations.
test-slow: .venv/test.stamp
	$(BIN)/python -m pytest -q -n auto --dist loadfile --max-worker-restart=0 -m "slow and not long"

# The rest, in parts that go on where they stopped: make test-long PART=garden; the record is benchmarks/results/long.json.
test-long: .venv/test.stamp
	$(BIN)/python tests/long/parts.py $(PART)

test-all: .venv/test.stamp
	$(BIN)/python -m pytest -q -n auto --dist loadfile --max-worker-restart=0

# Executed as a reader would; in the long tier by their cost.
notebooks: .venv/test.stamp
	$(BIN)/python -m pytest -q -m long tests/test_notebooks.py

# The site in build/site, manual pages in build/man, what an install brings in build/sbom.json; a warning is an error, and so is a dead link or a request to elsewhere.
docs: .venv/docs.stamp
	rm -rf build/site
	$(BIN)/python -m sphinx -q -W --keep-going -b html docs build/site
	$(BIN)/python docs/site/links.py build/site
	$(BIN)/python docs/site/man.py build/man
	$(BIN)/python docs/site/sbom.py build/sbom.json all

# All pages as one PDF, printed by a Chromium; the site of the working tree beside that of every tag.
pdf: .venv/docs.stamp
	$(BIN)/python docs/site/whole.py build/seatrial.pdf

versions: .venv/docs.stamp
	$(BIN)/python docs/site/whole.py --versions build/versions

lint: .venv/test.stamp
	$(BIN)/ruff check .

types: .venv/test.stamp
	$(BIN)/pyright

bench: .venv/bench.stamp
	set -e; for script in benchmarks/*.py; do $(BIN)/python $$script; done

clean:
	rm -rf .venv build dist demo .pytest_cache .ruff_cache .hypothesis

$(BIN)/python:
	$(PYTHON) -m venv .venv

.venv/core.stamp: $(DEFINITIONS) | $(BIN)/python
	$(PIP) -e .
	touch $@

# The nodejs extra brings the interpreter that pyright runs on, so no other is looked for or fetched.
.venv/test.stamp: $(DEFINITIONS) | $(BIN)/python
	$(PIP) -e ".[test]"
	touch $@

.venv/docs.stamp: $(DEFINITIONS) | $(BIN)/python
	$(PIP) -e ".[docs]"
	touch $@

.venv/bench.stamp: $(DEFINITIONS) | $(BIN)/python
	$(PIP) -e ".[bench]"
	touch $@
