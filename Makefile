# make demo, test, check, stress: each makes its own virtual environment .venv when there is none.
# PYTHON=... chooses the interpreter (3.11 or newer).

PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test check stress clean

demo: $(VENV)/.runtime
	$(BIN)/symfric demo --out out

test: $(VENV)/.test
	$(BIN)/python -m pytest

stress: $(VENV)/.test
	$(BIN)/python -m pytest -m slow

check: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/basedpyright --pythonpath $(BIN)/python

clean:
	rm -rf $(VENV) out dist build .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The stages build on each other, so that `make -j` never runs two installers at once.
$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "symfric needs Python 3.11 or newer; set PYTHON=..." >&2; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "symfric needs Python 3.11 or newer, got $(PYTHON); set PYTHON=..." >&2; exit 1; }
	"$(PYTHON)" -m venv $(VENV)

$(VENV)/.runtime: pyproject.toml | $(BIN)/python
	@echo "installing symfric into $(VENV)"
	$(BIN)/python -m pip install --quiet --editable ".[mat]"
	@touch $@

$(VENV)/.test: $(VENV)/.runtime
	@echo "installing what 'test' needs into $(VENV)"
	$(BIN)/python -m pip install --quiet --editable ".[test]"
	@touch $@

$(VENV)/.dev: $(VENV)/.test
	@echo "installing what 'dev' needs into $(VENV)"
	$(BIN)/python -m pip install --quiet --editable ".[dev]"
	@touch $@
