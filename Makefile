# touchplate: `make demo` shows it, `make test` checks it.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed
FLOOR  := $(shell sed -n 's/^requires-python = ">=\([0-9.]*\)".*/\1/p' pyproject.toml)
PIP    := $(BIN)/python -m pip --disable-pip-version-check

# The solves here are small: BLAS threads on top of ours make them slower, not faster.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1

.PHONY: help install torch demo test kernels slow gpu lint format bench report images docs system-deps clean

help:  ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/'

install: $(STAMP)  ## build .venv and install everything into it

$(STAMP): requirements.lock requirements-torch.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < tuple(map(int, "$(FLOOR)".split("."))))' || { \
	echo "touchplate needs Python $(FLOOR) or newer, $(PYTHON) is $$($(PYTHON) --version 2>&1);" \
	"run make with PYTHON=, say PYTHON=python3.12"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(PIP) install --quiet --no-deps --requirement requirements.lock
	@$(MAKE) --no-print-directory torch
	$(PIP) install --quiet --no-deps --no-build-isolation --editable .
	@touch $(STAMP)

# Torch trains nets; nothing else needs it. Its usual wheel for Linux brings gigabytes of libraries
# for a GPU: where there is none, only a build without them is taken.
TORCH := $(PIP) install --quiet --requirement requirements-torch.lock
torch:
	@if [ -e /dev/nvidia0 ] || ! $(TORCH) --dry-run --report - | grep -q '"name": "nvidia'; \
	then $(TORCH); \
	else echo "left out torch, which only training needs: its wheel here brings GPU libraries and this" \
	"machine has no GPU; give pip the address of PyTorch's CPU index (PIP_EXTRA_INDEX_URL) and run" \
	"'make torch'"; fi

demo: $(STAMP)  ## start the digital twin of a real bench and print the address of its page
	@exec $(BIN)/touchplate run bench-real

PYTEST := $(BIN)/python -m pytest --numprocesses auto --maxprocesses 4 --dist worksteal
# The kernels that most tests need are compiled first, beside the check of types: tests that start
# a command wait some seconds for its answer, not for a compiler.
test: $(STAMP)  ## linters, types, import layers and all tests but long ones
	@$(MAKE) --no-print-directory --jobs 2 lint kernels
	$(PYTEST) -m "not slow" --ignore tests/dic

kernels: $(STAMP)
	$(PYTEST) -m "not slow" tests/dic

slow: $(STAMP)  ## long tests and statistics, and every row of the table of stiff and extreme cases
	$(PYTEST) -m slow

gpu: $(STAMP)  ## the tests that need a GPU, where there is one
	$(BIN)/python -m pytest -m gpu

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/lint-imports

format: $(STAMP)  ## put the code into its form
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(STAMP)  ## score the whole way once, on rendered images; DATA=FOLDER holds images of others
	$(BIN)/touchplate report shipped photographs --full --out results/bench $(if $(DATA),--data $(DATA))

report: $(STAMP)  ## run all studies; the page is results/report/report.html
	$(BIN)/touchplate report

images: $(STAMP)  ## draw the images of docs/ anew; the page is filmed in Debian's chromium
	$(BIN)/python docs/images/photographs.py
	$(BIN)/python docs/images/plate.py
	$(BIN)/python docs/images/page.py
	$(BIN)/python docs/images/view.py
	$(BIN)/python docs/images/setup.py
	$(BIN)/python docs/images/demos.py

docs: $(STAMP)  ## build the pages of docs/ into results/site; a warning fails
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build

system-deps:  ## Debian packages that the tests of browser, display, devices and CalculiX need (as root)
	apt-get update -qq
	apt-get install -y -qq --no-install-recommends chromium xvfb calculix-ccx \
		umockdev gir1.2-umockdev-1.0 python3-gi libusb-1.0-0 liblo-tools sway grim libgl1-mesa-dri \
		xserver-xorg-core xserver-xorg-video-dummy x11-xserver-utils x11-apps

clean:  ## remove the virtual environment and caches of the tools
	rm -rf $(VENV) .pytest_cache .ruff_cache .import_linter_cache build dist
