# `make demo` and `make test` build .venv where it is missing, so each works alone on a machine with Python 3.11 and make.
PYTHON ?= python3.11
SOURCE ?=
SITE ?=
DEMO_RECORDING := out/demo/pointing.mcap
export DEMO_SOURCE = $(value SOURCE)
export DEMO_SITE = $(value SITE)
LINEUP ?= classic
BIN := .venv/bin
DISTRIBUTIONS := schemas runtime services/camera services/tracker services/headpose services/gesture services/fusion cli evaluation simulation conformance view bridges/ros2 calibration
PACKAGES := $(foreach d,$(DISTRIBUTIONS),$(d)/deixis_$(notdir $(d)))
# Guests in Python, each a distribution; all of MediaPipe in one environment of its own, for they need the same.
MEDIAPIPE := tracker_mediapipe headpose_mediapipe gesture_mediapipe
GUESTS := .venv/guests/mediapipe
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

.PHONY: setup guests rerun demo view test check bench contract references pages docs zenohd clean
setup: .venv/.installed

.venv/.installed: constraints.txt requirements-dev.txt $(addsuffix /pyproject.toml,$(DISTRIBUTIONS))
	@command -v $(PYTHON) >/dev/null || { echo "make: Deixis needs Python 3.11, and '$(PYTHON)' is not there (make PYTHON=...)" >&2; exit 1; }
	@echo "setting up .venv (about a minute) ..."
	@$(PYTHON) -m venv .venv
	@$(PIP) hatchling editables
	@# Built in isolation: py-dempster-shafer comes as source, and needs setuptools with wheel.
	@$(PIP) -r requirements-dev.txt
	@$(PIP) --no-build-isolation $(foreach d,$(DISTRIBUTIONS),-e $(d))
	@touch $@

# Stages made with MediaPipe, in an environment of their own within .venv (430 MB). Their libraries are installed as listed, see
# guests/constraints.txt; whether they load is tried before the guests themselves come.
guests: setup $(GUESTS)/.installed

$(GUESTS)/.installed: guests/constraints.txt constraints.txt $(patsubst %,guests/%/pyproject.toml,$(MEDIAPIPE))
	@echo "setting up the guests on MediaPipe (about a minute) ..."
	@$(PYTHON) -m venv $(GUESTS)
	@$(GUESTS)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps -r guests/constraints.txt
	@$(GUESTS)/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt hatchling editables
	@$(GUESTS)/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt --no-build-isolation -e schemas -e runtime
	@$(GUESTS)/bin/python -c "from mediapipe import solutions as s; s.face_detection, s.face_mesh, s.hands"
	@$(GUESTS)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation \
		$(patsubst %,-e guests/%,$(MEDIAPIPE))
	@touch $@

# The example clip, whose answer is known; or live: make demo SOURCE=0, SOURCE=clip.mp4, SOURCE=rtsp://... [SITE=site.yaml]
# With guests in the place of our stages: make demo LINEUP=mediapipe
demo: setup $(if $(filter-out classic,$(LINEUP)),guests)
ifeq ($(SOURCE),)
	@rm -f $(DEMO_RECORDING)  # what is shown afterwards is this run and none before
	@registry=$$(mktemp -u --suffix=.sqlite) && $(BIN)/deixis run examples/pointing.mp4 --site examples/pointing.yaml \
		--registry $$registry --expect P3 --lineup "$(LINEUP)" --out $(dir $(DEMO_RECORDING)); status=$$?; rm -f $$registry*; \
		[ ! -f $(DEMO_RECORDING) ] || printf '\n%s\n' "To see what it just did: make view (in a window), or make view WEB=1 (in a browser)"; exit $$status
else
	@echo "To see it while it runs, from another terminal: make rerun, once, then $(BIN)/deixis view --robot demo (or with --web)"
	@# By the environment: a URL with '&' or a name with blanks must not be read by the shell.
	@set -- "$$DEMO_SOURCE"; [ -z "$$DEMO_SITE" ] || set -- "$$@" --site "$$DEMO_SITE"; exec $(BIN)/deixis run --lineup "$(LINEUP)" "$$@"
endif

# What the last 'make demo' did, in pictures: in a window, or with WEB=1 as a page for this machine's browsers
WEB ?=
view: rerun
	@[ -f $(DEMO_RECORDING) ] || $(MAKE) --no-print-directory demo
	@$(BIN)/deixis view $(DEMO_RECORDING) --site examples/pointing.yaml --pictures examples/pointing.mp4 $(if $(WEB),--web)

# The viewer's library, which is large: whoever wants to see has it installed, and nobody else waits for it.
rerun: .venv/.rerun

.venv/.rerun: .venv/.installed view/pyproject.toml
	@echo "installing Rerun (660 MB) ..."
	@$(PIP) --no-build-isolation -e 'view[rerun]'
	@touch $@

# Some files start ten processes. With three at once two slow processors had a load of 27, and what has to begin in time did not.
WORKERS ?= 2
test: setup check
	@# A file's tests stay together, for they share the system that they run. tests/conftest.py says in which order.
	@$(BIN)/pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder

check: setup
	@$(BIN)/ruff check . && $(BIN)/ruff format --check --quiet . && $(BIN)/mypy $(PACKAGES) $(foreach g,$(MEDIAPIPE),guests/$(g)/deixis_$(g))
	@for tools in bench fitting docs; do MYPYPATH=$$tools $(BIN)/mypy $$tools/*.py || exit 1; done

bench: setup
	@$(BIN)/python bench/pipeline.py

# After a change of messages or topics: JSON Schema, golden bytes, the topic table and the page for people
contract: setup
	@$(BIN)/python -m deixis_schemas.export schemas/contract docs/contract.md

# After a change of settings or commands: their pages
pages: setup
	@$(BIN)/python docs/make_reference.py

# The pages as a site in build/docs, to be opened with a browser, or served from anywhere, which gives a search, too
docs: setup
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict --site-dir build/docs && echo "build/docs/index.html"

# After a meant change of what a stage answers to the shipped clips: says what has changed, and keeps it
references: setup
	@$(BIN)/python -m deixis_evaluation.references examples/clips tests/replay/references

# A stock zenohd for the tests that run the chain through one: built once from its crate, into the user's cache.
ZENOHD_ROOT := $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/deixis/zenohd
zenohd:
	@command -v cargo >/dev/null || { echo "make: building zenohd needs cargo" >&2; exit 1; }
	cargo install --quiet zenohd --version 1.10.2 --root $(ZENOHD_ROOT)
	@echo "$(ZENOHD_ROOT)/bin/zenohd"

clean:
	rm -rf .venv build dist
