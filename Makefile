# Targets are what a newcomer needs; `make` alone lists them.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help system setup weights demo test lint types unit browser cluster serve bench soak fuzz mutants clean

# The python to build the environment with: the newest of 3.10 to 3.13 on the PATH.
PYTHON ?= $(shell for name in python3.13 python3.12 python3.11 python3.10 python3 python; do \
	$$name -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] < (3, 14))' 2>/dev/null && command -v $$name && break; done)
# Where torch comes from, if not from PyPI, whose Linux build carries CUDA: https://download.pytorch.org/whl/cpu is small.
TORCH_INDEX ?=
# What `make bench` runs on.
DATA ?= tests/data/bursts
OUT ?= out
# How long `make fuzz` goes on.
FUZZ_SECONDS ?= 600

# Debian's packages with the libraries that Open3D links to, and those libraries.
LIBRARIES := libusb-1.0-0 libgl1 libegl1 libx11-6 libudev1 libidn2-0
SONAMES := libusb-1.0.so.0 libGL.so.1 libEGL.so.1 libX11.so.6 libudev.so.1 libidn2.so.0
# What the console's tests drive, and what Playwright links to.
BROWSER := chromium libatomic1

# $(call get,PACKAGES,WHY): root installs them, others are told how.
get = { [ "$$(id -u)" = 0 ] && echo "installing $(1)" && apt-get update -qq && apt-get install -y -qq --no-install-recommends $(1); } >&2 || \
	{ echo "$(2); on Debian and Ubuntu: sudo apt-get install $(1)" >&2; exit 1; }
# $(call loads,LIBRARIES): whether they are there.
loads = $(PYTHON) -c 'import ctypes; [ctypes.CDLL(each) for each in "$(1)".split()]' 2>/dev/null

VENV := .venv
BIN := $(VENV)/bin
# Stamps: what the service and the demo need is installed; and the developers' tools.
READY := $(VENV)/.ready
TOOLS := $(VENV)/.tools
# Shows its progress on a terminal, unless most is there already.
PIP = PYTHONWARNINGS=ignore $(BIN)/python -m pip install $$([ -t 2 ] && [ ! -e $(BIN)/onelook ] || echo --quiet) --disable-pip-version-check --constraint constraints.txt

help: ## list the targets
	@echo "OneLook. make TARGET, where TARGET is one of"
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
	@echo "Variables: TORCH_INDEX=https://download.pytorch.org/whl/cpu (torch without CUDA), PYTHON=python3.12, DATA=folder, OUT=folder, FUZZ_SECONDS=600"

setup: $(TOOLS) ## make the virtual environment .venv and install everything in it, the developers' tools too

# Before pip, which takes minutes.
system:
	@[ -e $(READY) ] || { $(PYTHON) -c 'import ensurepip' 2>/dev/null && $(call loads,$(SONAMES)); } || \
		$(call get,python3-venv $(LIBRARIES),OneLook needs Python 3.10 to 3.13 with its venv module and what Open3D links to)

$(READY): extra := server
$(TOOLS): extra := dev
# Torch by itself: an index beside PyPI would be asked for each of the hundred and more other packages too.
$(READY) $(TOOLS): pyproject.toml constraints.txt | system
	@if [ -z "$(PYTHON)" ]; then echo "OneLook needs Python 3.10 to 3.13, and none is on the PATH; install one, or name it: make PYTHON=/path/to/python3.12" >&2; exit 1; fi
	@$(BIN)/python -c '' 2>/dev/null || { echo "making $(VENV) with $(PYTHON)"; $(PYTHON) -m venv --clear $(VENV) || { rm -rf $(VENV); exit 1; }; }
	@[ -e $(BIN)/onelook ] && echo "installing what is new" || echo "installing (downloads $(if $(TORCH_INDEX),less than a gigabyte,several gigabytes where torch brings CUDA))"
	@$(if $(TORCH_INDEX),$(PIP) --no-deps --index-url $(TORCH_INDEX) torch)
	@$(PIP) --editable '.[$(extra)]'
	@touch $(READY) $@

weights: $(READY) ## fetch and convert the embedded backbone's weights, once
	@$(BIN)/python -c 'from core.backbones.weights import embedded_weights; print(embedded_weights(report=print))'

demo: $(READY) ## run the service and a simulated robot against it, on real weights; writes out/demo/report.html
	@$(BIN)/onelook simulate --out $(OUT)/demo

test: browser lint types unit ## lint, types and the whole test suite

lint: setup
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check --quiet . || { echo "run $(BIN)/ruff format ." >&2; exit 1; }

types: setup
	@$(BIN)/mypy

browser: system
	@{ command -v chromium >/dev/null && $(call loads,libatomic.so.1); } || $(call get,$(BROWSER),the console's tests need Chromium and Playwright's library)

# Two processes of one thread each; `worksteal`, since the other ways to share tests out lose those that have one name.
unit: browser setup
	@OMP_NUM_THREADS=1 $(BIN)/pytest --numprocesses 2 --dist worksteal

fuzz: setup ## feed everything that reads uploads what breaks it, ten minutes long; what it finds is kept in OUT
	@$(BIN)/python -m tests.fuzz --seconds $(FUZZ_SECONDS) --found $(OUT)/fuzz

mutants: setup ## which small changes of sim3, correspond, novelty, the scores and store/ does no test notice?
	@$(PIP) --editable '.[mutants]'
	@OMP_NUM_THREADS=1 $(BIN)/python -m tests.mutants

cluster: setup ## kill the parts of a service on Ray Serve, one after the other: they come back, and nothing that was answered is lost
	@$(BIN)/pytest tests/service/cluster/recovery.py

serve: $(READY) ## the service on 127.0.0.1:8000
	@$(BIN)/onelook serve

bench: $(READY) ## accuracy and discovery of the recordings in DATA; tables, and JSON in OUT
	@$(BIN)/onelook bench pose --data $(DATA) --json $(OUT)/pose.json
	@$(BIN)/onelook bench discovery --data $(DATA) --json $(OUT)/discovery.json

soak: $(READY) ## two robots live with a service for half an hour; fails where it grows; a plot and JSON in OUT
	@$(BIN)/onelook bench soak --minutes 30 --robots 2 --plot $(OUT)/soak.png --json $(OUT)/soak.json

clean: ## remove what make made; weights and encoded bursts stay in the user's cache
	@rm -rf $(VENV) build mutants *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis $(OUT)
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +
