# Needs make and Python >= 3.11; everything else is installed into .venv, inside this folder.
PYTHON ?= python3
BIN := .venv/bin
# Without a word of what the wheel of a robot, which tests read without running it, would need to run; Python compiles
# what it imports, which is a small part of what is installed.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-warn-conflicts --no-compile
# What a run of the machines needs, and with it what tests and checks need.
READY := .venv/.ready
STAMP := .venv/.installed
# The kernels, compiled in place where there is a C compiler; without one they are plain Python.
MODULE := build/kernels/.made
KERNELS := $(shell find src/pfabrik/kernels src/pfabrik/to_c tools/kernels -name '*.py' -o -name '*.[ch]')
# Matrices are small here: threads of the linear algebra would only wait for each other, the more so where tests run in
# parallel.
export OPENBLAS_NUM_THREADS := 1
export MPLCONFIGDIR := $(CURDIR)/.venv/matplotlib
# Tests start many processes, and pytest rewrites every assertion: compiled files are kept, whatever the user's settings.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: prepared demo reproduce docs test test-processors test-tensors test-all test-interpreted campaign check bench web clean

demo: $(READY) $(MODULE)
	@$(BIN)/pfabrik demo

# What tests and checks need is installed while kernels compile.
prepared: $(READY)
	@$(MAKE) --no-print-directory --jobs=2 $(STAMP) $(MODULE)

# The experiments of the paper, next to what it printed: a report, pictures and CSV files in out/.
reproduce: prepared
	@$(BIN)/python -m paper

# The documentation as a site, in site/; no page needs the network. Machines are exported and notebooks run for it; it
# stops at a link that leads nowhere.
docs: prepared
	@$(PIP) --no-build-isolation --editable '.[docs]'
	@$(BIN)/python tools/site/build_site.py
	@$(BIN)/zensical build --clean --strict

# In parallel.
test: prepared
	@$(BIN)/python -m pytest -n auto --dist worksteal

# What `make test` leaves out: tests that cost much, and two thirds of the matrix of machines and questions.
test-all: prepared
	@$(BIN)/python -m pytest -n auto --dist worksteal -m "slow and not campaign and not pages"

# The programs of pages, examples and notebooks, with the linear algebra of other processors than this one (of Zen it is
# that of Haswell, of one with AVX-512 that of SkylakeX, which `make test` has run here).
test-processors: prepared
	@for core in $(shell grep -qs avx512bw /proc/cpuinfo && echo Haswell) Prescott; do \
		OPENBLAS_CORETYPE=$$core $(BIN)/python -m pytest -n auto --dist worksteal -m "not campaign" tests/test_docs.py \
		tests/test_notebooks.py tests/test_transcripts.py || exit 1; done

# Files of tensors in PyTorch and JAX, which are large: in an environment of their own. `make campaign` runs it, with all
# machines (TENSORS='-m ""'); continuous integration does not, as it takes minutes to install.
test-tensors: $(STAMP)
	@$(BIN)/python -m venv .venv/tensors
	@.venv/tensors/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[tensors]' hypothesis pytest scipy
	@.venv/tensors/bin/python -m pytest $(TENSORS) tests/test_tensors.py

# The same tests with the kernels as plain Python: this run sees every line, so it measures coverage.
test-interpreted: $(STAMP)
	@PFABRIK_KERNELS=python $(BIN)/python -m pytest -m "not compiled and not slow and not campaign and not pages" --cov --cov-report=term

# Before a release, and where kernels have changed: the long random runs, and every property on many more examples.
campaign: prepared
	@PFABRIK_HYPOTHESIS=explore $(BIN)/python -m pytest -n auto --dist worksteal -m "campaign or hypothesis"
	@$(MAKE) --no-print-directory test-tensors TENSORS='-m ""'

check: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy --strict src paper tests/typing
	$(BIN)/lint-imports
	$(BIN)/python tools/counts.py --check

# The kernels of web pages, src/pfabrik/view/page/kernels.wasm, which is kept in the repository: needs clang and wasm-ld (lld).
web: $(READY)
	@$(BIN)/python tools/kernels/compile_web.py

bench: prepared
	@$(BIN)/python benchmarks/run.py

clean:
	rm -rf .venv .cache out site build dist htmlcov .coverage .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	rm -f src/pfabrik/kernels/_compiled.*
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(READY): pyproject.toml
	@command -v $(PYTHON) > /dev/null || { echo "'$(PYTHON)' not found; try: make PYTHON=/path/to/python3" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit(v < (3, 11) and "Python >= 3.11 is needed; %s is %d.%d. Try: make PYTHON=python3.12" % (sys.executable, v[0], v[1]))'
	@printf 'installing pfabrik into .venv ' >&2
	@(while sleep 2 && kill -0 $$$$ 2>/dev/null; do printf . >&2; done) & dots=$$!; trap 'kill $$dots' EXIT; \
		$(PYTHON) -m venv .venv && \
		$(PIP) hatchling editables numpy && $(PIP) --no-build-isolation --editable '.[plot]' && echo >&2
	@touch $@

$(MODULE): $(READY) $(KERNELS)
	@$(BIN)/python tools/kernels/compile_kernels.py || [ $$? = 3 ]
	@mkdir -p $(@D) && touch $@

$(STAMP): $(READY)
	@printf 'installing what tests and checks need ' >&2
	@(while sleep 2 && kill -0 $$$$ 2>/dev/null; do printf . >&2; done) & dots=$$!; trap 'kill $$dots' EXIT; \
		$(PIP) --no-build-isolation --editable '.[plot,collide,dev]' && echo >&2
	@# the model of a robot, which tests read from its maker's wheel: without what its programs need, and skipped without it
	@-$(PIP) --no-deps reachy-mini reachy-mini-rust-kinematics
	@touch $@
