# Every target creates the virtual environment .venv if it does not exist. PYTHON=... selects the interpreter
# (3.11 or newer). `make newest` runs the tests, except heavy ones, on the newest installed interpreter with the
# newest NumPy in .venv-newest; `make extras` runs the tests with other tools in .venv-extras.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
# The test workers occupy all cores; threads of BLAS would only compete with them.
ONE_THREAD := OPENBLAS_NUM_THREADS=1
BIN := $(VENV)/bin

.PHONY: demo test docs docs-check newest extras check stress mutants embedded clean

demo: $(VENV)/.runtime
	$(BIN)/symfric demo --out out

# `make test SHARE=7/31` also runs the slow tests of a share.
test: $(VENV)/.test
	$(ONE_THREAD) $(BIN)/python -m pytest -n auto --dist loadfile $(if $(SHARE),--share $(SHARE) -m "not slow or due")

# Build the pages in out/docs. SYMFRIC_DOCS=quick computes the gallery of the papers at reduced size;
# SYMFRIC_DOCS=keep reuses all existing pictures.
docs: $(VENV)/.docs
	$(ONE_THREAD) $(BIN)/python -m sphinx -W --keep-going -n -q -j auto -d out/doctrees docs out/docs
	@echo "docs: out/docs/index.html"

# Open every page in a browser, narrow and wide; without Chromium, print a message.
docs-check: docs
	$(BIN)/python -m docs.machine.browser out/docs

newest:
	@newest="$$(sh .ci/newest-python "$(PYTHON)")"; \
	if [ -z "$$newest" ]; then echo "newest: no interpreter newer than $(PYTHON), nothing run"; else \
		echo "newest: $$($$newest --version)"; \
		$(MAKE) VENV=.venv-newest PYTHON="$$newest" .venv-newest/.test && \
		.venv-newest/bin/python -m pip install --quiet --upgrade numpy && \
		.venv-newest/bin/python -c 'import numpy; print("newest: NumPy", numpy.__version__)' && \
		.venv-newest/bin/python -m pytest -n auto --dist loadfile -p no:cacheprovider \
			-m "not slow and not heavy"; fi

# Compare FMUs, kernels and robots with other tools; print a message if their wheels are not available.
extras:
	@$(MAKE) VENV=.venv-extras .venv-extras/.test
	@if .venv-extras/bin/python -m pip install --quiet --editable ".[fmu,cuda-check,pinocchio,interop,cluster]"; then \
		.venv-extras/bin/python -m pytest -n auto --dist loadfile -p no:cacheprovider \
			tests/interop tests/symfric/fmu tests/symfric/integrator/cuda tests/symfric/codegen/blocks \
			tests/symfric/multibody/urdf tests/identification/robot; \
	else echo "extras: the wheels of FMPy, NVRTC, Pinocchio, rockit, do-mpc or Dask are not available, nothing run"; fi

stress: $(VENV)/.test
	$(BIN)/python -m pytest -m slow
	$(BIN)/python -m pytest --hypothesis-profile stress tests/symfric/laws
	$(BIN)/python -m pytest --recompute tests/symfric/scenes tests/symfric/integrator/test_accuracy.py
	$(BIN)/symfric stress --cases 10000 --json out/stress.json --out out/stress_cases
	$(BIN)/symfric bench identification --json out/identification.json --plot out/identification.png

mutants: $(VENV)/.test
	$(BIN)/python tests/mutants.py

# Needs arm-none-eabi-gcc, newlib and qemu-system-arm; lists missing programs and succeeds without them.
embedded: $(VENV)/.runtime
	$(BIN)/symfric bench embedded

check: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/basedpyright --pythonpath $(BIN)/python

clean:
	rm -rf $(VENV) .venv-newest .venv-extras out dist build .pytest_cache .ruff_cache .hypothesis
	rm -rf docs/made docs/laws docs/scenes docs/gallery docs/examples docs/reference docs/benchmarks/*.md
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Each stage depends on the previous one, so that `make -j` never runs two installers at once.
$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "symfric needs Python 3.11 or newer; set PYTHON=..." >&2; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "symfric needs Python 3.11 or newer, got $(PYTHON); set PYTHON=..." >&2; exit 1; }
	"$(PYTHON)" -m venv $(VENV)

$(VENV)/.runtime: pyproject.toml | $(BIN)/python
	@echo "installing symfric into $(VENV)"
	$(BIN)/python -m pip install --quiet --editable .
	@touch $@

$(VENV)/.test: $(VENV)/.runtime
	@echo "installing the requirements of 'test' into $(VENV)"
	$(BIN)/python -m pip install --quiet --editable ".[test]"
	@touch $@

$(VENV)/.docs: $(VENV)/.test
	@echo "installing the requirements of 'docs' into $(VENV)"
	$(BIN)/python -m pip install --quiet --editable ".[docs]"
	@touch $@

$(VENV)/.dev: $(VENV)/.docs
	@echo "installing the requirements of 'dev' into $(VENV)"
	$(BIN)/python -m pip install --quiet --editable ".[dev]"
	@touch $@
