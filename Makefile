# Commands for developers; `make help` lists them. Set-up is automatic: a command that needs .venv creates it and brings it
# up to date with the pinned requirements, silently when there is nothing to do.

PYTHON ?= python3

BIN := .venv/bin
PIP := $(BIN)/python -m pip --quiet --disable-pip-version-check
FOR_USE := .venv/installed-for-use
FOR_DEVELOPMENT := .venv/installed-for-development
FOR_ALL_TESTS := .venv/installed-for-all-tests

# Three workers, because many tests wait for processes in real time. The checks run beside them.
# For one thing after the other, in one process: make test WORKERS=
WORKERS ?= 3
PYTEST = $(BIN)/python -m pytest -q $(if $(WORKERS),-n $(WORKERS))
CHECKS = $(MAKE) --no-print-directory checks
WITH_CHECKS = $(if $(WORKERS), \
	$(CHECKS) >.venv/checks.log 2>&1 & checks=$$!; trap 'kill $$checks' INT TERM; \
	$(1); code=$$?; wait $$checks || { cat .venv/checks.log; code=1; }; exit $$code, \
	$(CHECKS) && $(1))

# Python keeps what it has compiled, whatever the environment says: the tests start hundreds of processes, and each would
# compile all of its sources again.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
# Even with -j: `page` and the background part of `lint` both install the page's packages into one folder.
.NOTPARALLEL:
.PHONY: help serve demo docs page test test-thorough test-all checks compiled page-tests lint format types requirements bench golden net firmware clean distclean

help: ## list these commands
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-13s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

serve: $(FOR_USE) ## the dashboard and the service, on the mock controller unless daq.toml says otherwise
	@$(BIN)/python hatch_build.py
	@$(BIN)/daq serve

demo: $(FOR_USE) ## record a ramp-step on joints 1-3 of the mock controller, and show it
	@$(BIN)/daq demo

docs: $(FOR_DEVELOPMENT) ## build the documents' site into docs/_site, strictly; a notebook that has changed is run (minutes)
	@$(BIN)/sphinx-build -W --keep-going -n --quiet -d build/docs/doctrees docs docs/_site
	@echo "docs/_site/index.html"

page: | $(FOR_USE) ## build the dashboard's page where it is out of date
	@$(BIN)/python hatch_build.py

test: $(FOR_DEVELOPMENT) page ## lint, types, import contracts, the quick tests and one path through every door
	@$(call WITH_CHECKS,$(PYTEST) -m "not slow" --part quick)

test-thorough: compiled ## all other tests, but for the slow ones
	@echo "== thorough tests"
	@$(PYTEST) -m "not slow" --part thorough

test-all: compiled ## every test, the slow ones too
	@$(call WITH_CHECKS,$(PYTEST))

checks: $(FOR_DEVELOPMENT) page ## lint and the tests of the page
	@$(MAKE) --no-print-directory lint page-tests

# What all workers of the tests need is compiled once: each would do it again, or wait for the one that does.
compiled: $(FOR_ALL_TESTS) page ## compile what the thorough tests need
	@$(BIN)/python -m tests.compile_ahead

page-tests: $(FOR_DEVELOPMENT) ## the tests of the modules of the page
	@echo "== tests of the page's modules"
	@$(BIN)/python hatch_build.py test

lint: $(FOR_DEVELOPMENT) page ## lint, format, types and import contracts, without the tests
	@echo "== page"
	@$(BIN)/python hatch_build.py check >.venv/page-check.log 2>&1 & page=$$!; \
	echo "== lint" && $(BIN)/ruff check --quiet && \
	echo "== format" && $(BIN)/ruff format --quiet --check --diff && \
	echo "== types" && $(BIN)/mypy --no-error-summary && \
	echo "== import contracts" && { $(BIN)/lint-imports >.venv/import-contracts.log 2>&1 || { cat .venv/import-contracts.log; false; }; }; \
	code=$$?; wait $$page || { cat .venv/page-check.log; code=1; }; exit $$code

format: $(FOR_DEVELOPMENT) ## format the sources and mend what ruff can mend
	@$(BIN)/ruff check --fix-only --quiet
	@$(BIN)/ruff format --quiet
	@$(BIN)/python hatch_build.py format

types: $(FOR_DEVELOPMENT) ## make the page's types of the API anew, after a change of the API
	@$(BIN)/python hatch_build.py types format

bench: $(FOR_DEVELOPMENT) ## measure what docs/benchmarks.md claims, each figure beside its floor and what was measured before (5 minutes)
	@$(BIN)/python -m benchmarks ledger

golden: $(FOR_DEVELOPMENT) ## compare answers of every command with those recorded before, to the digit (20 minutes)
	@$(BIN)/python -m benchmarks.golden

# What a large change must not tear: less than 10 minutes on two cores.
NET_GOLDEN = api trace help small design/3 fit/rig diagnose/rig-bench diagnose/rig-single fit/0 validate/0 compare/0 \
	diagnose/single-coulomb_friction-1 diagnose/pair-0 diagnose/secret-110 diagnose/open-tight_spot
NET_TESTS = tests/protocol tests/contract tests/daq_cli/test_run.py tests/server/command_line \
	tests/server/dashboard/test_from_form_to_trace.py

net: $(FOR_DEVELOPMENT) page ## golden answers, vectors, contracts, a ramp in real time, the service, test rigs (10 minutes)
	@code=0; \
	echo "== golden answers"; $(BIN)/python -m benchmarks.golden $(NET_GOLDEN) || code=1; \
	echo "== vectors, contracts, a ramp, the service"; $(PYTEST) -m "not slow" $(NET_TESTS) || code=1; \
	echo "== test rigs"; $(BIN)/python -m trials.net || code=1; \
	exit $$code

firmware: $(if $(MAP),$(FOR_USE)) ## build the bridge's programs for boards, from Debian's packages; MAP=FILE.toml: the Mega's, for that memory map
	@$(MAKE) --no-print-directory -C firmware_protocol/bridge BUILD=$(CURDIR)/build/firmware \
	    $(if $(MAP),MAP=$(abspath $(MAP)) PYTHON=$(CURDIR)/$(BIN)/python mega2560,all)

clean: ## remove caches and what was built
	@rm -rf build dist docs/_site server/dashboard/dist .mypy_cache .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	@find . -name __pycache__ -type d -not -path './.venv/*' -prune -exec rm -rf {} +

distclean: clean ## the same, and .venv
	@rm -rf .venv server/dashboard/node_modules

# ---- the virtual environment

# uv installs in a seventh of pip's time. It does not read pip's configuration; where the package index is configured for
# pip only, pip is tried next.
INSTALL = $(BIN)/uv pip install --quiet --python $(BIN)/python --require-hashes --requirement $(1) \
	|| { echo "uv could not install them; trying pip"; $(PIP) install --require-hashes --requirement $(1); }

$(FOR_USE): requirements.txt pyproject.toml | $(BIN)/uv
	@echo "Installing the pinned requirements into .venv"
	@$(call INSTALL,requirements.txt)
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@touch $@

$(FOR_DEVELOPMENT): requirements-dev.txt $(FOR_USE)
	@echo "Installing the pinned requirements of development into .venv"
	@$(call INSTALL,requirements-dev.txt)
	@touch $@

$(FOR_ALL_TESTS): requirements-thorough.txt $(FOR_DEVELOPMENT)
	@echo "Installing the pinned requirements of the thorough tests into .venv"
	@$(call INSTALL,requirements-thorough.txt)
	@touch $@

$(BIN)/uv: requirements-installer.txt | $(BIN)/pip
	@$(PIP) install --require-hashes --requirement requirements-installer.txt
	@touch $@

# ensurepip writes pip last: a .venv whose creation was interrupted, or that uv made, has no pip and is created again.
$(BIN)/pip:
	@command -v $(PYTHON) >/dev/null || { echo "No $(PYTHON) found: install Python 3.11 or newer, or name one: make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -c 'import sys; v = sys.version_info; v >= (3, 11) or sys.exit("Python 3.11 or newer is needed and $(PYTHON) is %d.%d: name a newer one: make PYTHON=python3.12" % v[:2])'
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "$(PYTHON) cannot make virtual environments: install its venv package (Debian, Ubuntu: apt install python3-venv)"; exit 1; }
	@$(PYTHON) -m venv --clear .venv

# ---- the pinned requirements: with hashes, for every platform, and without the address of any package index

UPGRADE ?=
COMPILE = $(BIN)/uv pip compile --quiet $(UPGRADE) --universal --python-version 3.11 --generate-hashes \
	--no-emit-index-url --custom-compile-command "make requirements"

# Those of development come first: what the tests need may hold a package back that the product alone would not.
requirements: $(FOR_DEVELOPMENT) ## pin what pyproject.toml asks for (UPGRADE=--upgrade: the newest of everything)
	@$(COMPILE) --group installer --output-file requirements-installer.txt
	@$(COMPILE) pyproject.toml --extra all --group build --group dev --output-file requirements-dev.txt
	@$(COMPILE) pyproject.toml --extra webrtc --group thorough --constraint requirements-dev.txt --output-file requirements-thorough.txt
	@$(COMPILE) pyproject.toml --extra all --group build --constraint requirements-dev.txt --output-file requirements.txt
	@$(COMPILE) --group release --constraint requirements-dev.txt --output-file requirements-release.txt
	@$(MAKE) --no-print-directory $(FOR_DEVELOPMENT)
