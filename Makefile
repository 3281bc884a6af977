# Two commands do everything on a machine with Python 3.11+ and make: `make demo`, `make test`.
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.installed

.PHONY: demo test slow lint docs tables bench clean

demo: $(STAMP)
	@echo "Running the case buckling; the first run compiles some kernels, which takes seconds."
	@mkdir -p demo
	$(BIN)/stokesfibers run cases/buckling.toml --out demo/buckling.zarr --overwrite
	$(BIN)/stokesfibers plot demo/buckling.zarr panels --out demo/shapes.png
	$(BIN)/stokesfibers plot demo/buckling.zarr stress --out demo/stress.png
	@echo "The run is in demo/buckling.zarr; pictures: demo/shapes.png (like Fig. 4), demo/stress.png (N1 and shear stress)"

test: lint
	$(BIN)/python -m pytest -q -n 2

slow: $(STAMP)-dev
	$(BIN)/python -m pytest -q -n 2 -m slow

lint: $(STAMP)-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/pyright
	$(BIN)/lint-imports

docs: $(STAMP)-dev
	$(BIN)/sphinx-build -W --keep-going -b html docs docs/_build/html

tables: $(STAMP)-dev
	$(BIN)/python docs/generate/validation.py
	$(BIN)/python docs/generate/traceability.py

bench: $(STAMP)-dev
	$(BIN)/python benchmarks/step.py
	$(BIN)/python benchmarks/suspension.py
	$(BIN)/python benchmarks/spectral.py
	$(BIN)/python benchmarks/ewald.py --counts 1e4 1e5
	$(BIN)/python benchmarks/large.py --counts 100 300 1000

$(STAMP): pyproject.toml
	@echo "Installing into .venv: about a minute, silent unless something goes wrong."
	@test -d .venv || $(PYTHON) -m venv .venv
	$(BIN)/pip install -q -e ".[fast,sweep]"
	@touch $@
	@echo "Installed. For the commands in this shell: source .venv/bin/activate"

$(STAMP)-dev: $(STAMP)
	@echo "Installing what checks and tests need into .venv: about a minute more."
	$(BIN)/pip install -q -e ".[dev]"
	touch $@

clean:
	rm -rf .venv demo out build dist docs/_build docs/gallery
