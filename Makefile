# Everything is done in a virtual environment of the project's own; only Python 3.11+ is needed.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet

.PHONY: demo test check benchmark results comparison trackers ablation peers study examples picture clean

demo: $(VENV)/run.stamp  ## Reconstruct the built-in motions; pictures and BVH files in demo/
	$(BIN)/sixpoint demo --force

test: $(VENV)/dev.stamp  ## Run the tests
	$(BIN)/python -m pytest

check: $(VENV)/dev.stamp  ## Lint and type-check
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

benchmark: $(VENV)/run.stamp  ## Time a warm solver beside forward kinematics
	$(BIN)/python benchmarks/speed.py

results: $(VENV)/run.stamp  ## Measure the paper's clips again and rewrite docs/results.md
	$(BIN)/python benchmarks/paper_table.py
	$(BIN)/python benchmarks/sik_plus_table.py --write

comparison: $(VENV)/run.stamp  ## Compare all methods on the paper's clips and rewrite docs/results.md
	$(BIN)/python benchmarks/comparison.py

trackers: $(VENV)/run.stamp  ## Measure trackers with six degrees of freedom and rewrite docs/results.md
	$(BIN)/python benchmarks/trackers.py --write

ablation: $(VENV)/run.stamp  ## Switch off each rule and input of SIK+ and rewrite docs/results.md
	$(BIN)/python benchmarks/ablation.py

peers: $(VENV)/run.stamp  ## Time six targets on hinges beside mink and rewrite docs/results.md
	@$(PIP) install --editable '.[bench]'
	$(BIN)/python benchmarks/peers.py --docs

study: $(VENV)/run.stamp  ## Make the figures of both papers again and rewrite docs/flext and docs/sik
	$(BIN)/sixpoint study flext --out docs/flext --force
	$(BIN)/sixpoint study sik --out docs/sik --force

examples: $(VENV)/run.stamp  ## Run the examples and rewrite docs/shelf_reach
	$(BIN)/python examples/shelf_reach.py --out docs/shelf_reach --force
	rm docs/shelf_reach/*.bvh

picture: $(VENV)/run.stamp  ## Draw the picture of the README again
	$(BIN)/sixpoint demo --sample climb_and_hang --out demo --force
	cp demo/climb_and_hang.png docs/demo.png

clean:
	rm -rf $(VENV) demo

$(VENV)/run.stamp: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "sixpoint needs Python 3.11 or newer; try: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	@echo "installing into $(VENV) (once)"
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(PIP) install --editable .
	@touch $@

$(VENV)/dev.stamp: $(VENV)/run.stamp
	@$(PIP) install --editable '.[dev]'
	@touch $@
