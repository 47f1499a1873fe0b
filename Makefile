# `make demo` and `make test` build .venv where it is missing, so each works alone on a machine with Python 3.11 and make.
PYTHON ?= python3.11
SOURCE ?=
BIN := .venv/bin
DISTRIBUTIONS := schemas runtime services/camera services/tracker services/headpose services/gesture services/fusion cli evaluation
EDITABLE := $(foreach d,$(DISTRIBUTIONS),-e $(d))

.PHONY: setup demo test check bench clean
setup: .venv/.installed

.venv/.installed: constraints.txt requirements-dev.txt $(addsuffix /pyproject.toml,$(DISTRIBUTIONS))
	@command -v $(PYTHON) >/dev/null || { echo "make: Deixis needs Python 3.11; '$(PYTHON)' is not there (set PYTHON=...)" >&2; exit 1; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt hatchling editables
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt --no-build-isolation -r requirements-dev.txt $(EDITABLE)
	@touch $@
