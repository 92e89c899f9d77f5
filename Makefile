# Targets are what a newcomer needs; `make` alone lists them.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help setup weights demo test lint types unit browser cluster serve bench soak fuzz mutants clean

# The python to build the environment with: the newest of 3.10 to 3.13 on the PATH.
PYTHON ?= $(shell for name in python3.13 python3.12 python3.11 python3.10 python3 python; do \
	$$name -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] < (3, 14))' 2>/dev/null && command -v $$name && break; done)
# Where else to look for torch: https://download.pytorch.org/whl/cpu is small, PyPI's Linux build carries CUDA.
TORCH_INDEX ?=
# What `make bench` runs on.
DATA ?= tests/data/bursts
OUT ?= out
# How long `make fuzz` goes on.
FUZZ_SECONDS ?= 600

# Debian's packages with the libraries that Open3D links to.
LIBRARIES := libusb-1.0-0 libgl1 libegl1 libx11-6 libudev1 libidn2-0

INSTALL_BROWSER = { echo "installing chromium"; apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium; } >&2

INSTALL_LIBRARIES = { echo "installing $(LIBRARIES)"; apt-get update -qq && apt-get install -y -qq --no-install-recommends $(LIBRARIES); } >&2

VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

help: ## list the targets
	@echo "OneLook. make TARGET, where TARGET is one of"
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
	@echo "Variables: TORCH_INDEX=https://download.pytorch.org/whl/cpu (torch without CUDA), PYTHON=python3.12, DATA=folder, OUT=folder, FUZZ_SECONDS=600"

setup: $(READY) ## make the virtual environment .venv and install everything in it

$(READY): pyproject.toml constraints.txt
	@if [ -z "$(PYTHON)" ]; then echo "OneLook needs Python 3.10 to 3.13, and none is on the PATH; install one, or name it: make PYTHON=/path/to/python3.12" >&2; exit 1; fi
	@if ! $(BIN)/python -c '' 2>/dev/null; then echo "making $(VENV) with $(PYTHON)"; $(PYTHON) -m venv --clear $(VENV) || \
		{ echo "Python's venv module is missing; on Debian and Ubuntu: sudo apt-get install python3-venv" >&2; rm -rf $(VENV); exit 1; }; fi
	@echo "installing (the first time downloads $(if $(TORCH_INDEX),a few hundred megabytes,several gigabytes where torch brings CUDA))"
	@PYTHONWARNINGS=ignore $(BIN)/python -m pip install $$([ -t 2 ] || echo --quiet) --disable-pip-version-check --constraint constraints.txt $(if $(TORCH_INDEX),--extra-index-url $(TORCH_INDEX)) --editable '.[server,dev]'
	@$(BIN)/python -c 'import open3d' 2>/dev/null || $(if $(filter 0,$(shell id -u)),$(INSTALL_LIBRARIES),false) && $(BIN)/python -c 'import open3d' || \
		{ echo "Open3D needs system libraries; run: sudo apt-get install $(LIBRARIES)" >&2; exit 1; }
	@touch $@

weights: setup ## fetch and convert the embedded backbone's weights, once
	@$(BIN)/python -c 'from core.backbones.weights import embedded_weights; print(embedded_weights(report=print))'

demo: setup ## run the service and a simulated robot against it, on real weights; writes out/demo/report.html
	@$(BIN)/onelook simulate --out $(OUT)/demo

test: lint types unit ## lint, types and the whole test suite

lint: setup
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check --quiet . || { echo "run $(BIN)/ruff format ." >&2; exit 1; }

types: setup
	@$(BIN)/mypy

# The console's tests drive it.
browser:
	@command -v chromium >/dev/null || $(if $(filter 0,$(shell id -u)),$(INSTALL_BROWSER),{ echo "the console's tests need Chromium; run: sudo apt-get install chromium" >&2; false; })

# Two processes of one thread each; `worksteal`, since the other ways to share tests out lose those that have one name.
unit: setup browser
	@OMP_NUM_THREADS=1 $(BIN)/pytest --numprocesses 2 --dist worksteal

fuzz: setup ## feed everything that reads uploads what breaks it, ten minutes long; what it finds is kept in OUT
	@$(BIN)/python -m tests.fuzz --seconds $(FUZZ_SECONDS) --found $(OUT)/fuzz

mutants: setup ## which small changes of sim3, correspond, novelty, the scores and store/ does no test notice?
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[mutants]'
	@OMP_NUM_THREADS=1 $(BIN)/python -m tests.mutants

cluster: setup ## kill the parts of a service on Ray Serve, one after the other: they come back, and nothing that was answered is lost
	@$(BIN)/pytest tests/service/cluster/recovery.py

serve: setup ## the service on 127.0.0.1:8000
	@$(BIN)/onelook serve

bench: setup ## accuracy and discovery of the recordings in DATA; tables, and JSON in OUT
	@$(BIN)/onelook bench pose --data $(DATA) --json $(OUT)/pose.json
	@$(BIN)/onelook bench discovery --data $(DATA) --json $(OUT)/discovery.json

soak: setup ## two robots live with a service for half an hour; fails where it grows; a plot and JSON in OUT
	@$(BIN)/onelook bench soak --minutes 30 --robots 2 --plot $(OUT)/soak.png --json $(OUT)/soak.json

clean: ## remove what make made; weights and encoded bursts stay in the user's cache
	@rm -rf $(VENV) build mutants *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis $(OUT)
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +
