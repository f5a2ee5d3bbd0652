# `make preview` and `make test` need Python 3.11, Rust and make; each does the rest of its set-up, in build/.

SCENE := examples/bunny.blend
REPORT = --scene "$(SCENE)"
VENV := build/venv
BIN := $(VENV)/bin
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check

ifndef PYTHON
PYTHON := $(shell for name in python3.11 python3 python; do \
	"$$name" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null && echo "$$name" && break; done)
endif
NO_PYTHON := This machine lacks Python 3.11. To install: (Debian 12) apt-get install python3.11 python3.11-venv; \
	elsewhere https://www.python.org/downloads/, then make PYTHON=/path/to/python3.11

# The program that benchmarks are measured with, built apart from the product.
HARNESS := $(CURDIR)/build/bench/target

# Folders too: a file that is gone changes nothing but its folder.
NATIVE := rust-toolchain.toml native/Cargo.toml native/Cargo.lock \
	$(shell find native/bih-core native/bih-python \( -name target -o -name __pycache__ \) -prune -o -print)

.PHONY: help preview test fuzz stress mutations bench bench-quick tables report lint lint-harness types test-rust test-harness test-neon \
	test-address test-miri test-memory test-loom test-python test-hosts package real-blender any-blender format lock clean machine \
	test-machine
.DELETE_ON_ERROR:

help:
	@echo "make preview [SCENE=my.blend]  trace the scene to build/preview.png and .exr, its tree to build/overlay.png"
	@echo "make test                      all checks and tests (lint, lint-harness, types, test-rust, test-harness, test-neon,"
	@echo "                               test-loom, then test-python)"
	@echo "make test-hosts [HOSTS=4.2]    the Blender tests in each version that is supported: 4.2, 4.5, 5.0, 5.2 (400 MB each)"
	@echo "make test-memory               what memory the core reads: AddressSanitizer, then Miri (half an hour or more)"
	@echo "make test-loom                 every order in which threads can meet where a tree is built on demand"
	@echo "make stress                    the hard cases long (hours): 10 million aimed rays, all of the sweeps, make mutations"
	@echo "make mutations                 mistakes made on purpose in a copy of native/, each of which a test must see"
	@echo "make fuzz [SECONDS=60]         fuzz meshes with rays, then saved trees, so long each"
	@echo "make bench [BENCH=--help]      measure beside the peers (three quarters of an hour), write docs/benchmarks.md"
	@echo "make bench-quick               the same on small scenes: answers and counts alone, for CI"
	@echo "make tables [TABLES=--help]    the slides' tables on this machine (some minutes), into docs/benchmarks.md"
	@echo "make report [SCENE=my.blend]   error against run time on a scene (some minutes), a page in build/report/;"
	@echo "                               or with REPORT=\"--built-in terrain --quick\""
	@echo "make package                   the extension's zip, in build/ (on Linux also with PLATFORM=linux-arm64)"
	@echo "make real-blender              a Blender for the tests, where none is installed (Debian, as root)"
	@echo "make format                    format Python and Rust"
	@echo "make lock                      every lock file from the .in file beside it"
	@echo "make clean                     delete all that was built"

preview: $(VENV)/.bihtree
	@$(BIN)/python -m addon.blender.command_line render --scene "$(SCENE)" --output build/preview.png \
		--output build/preview.exr --overlay build/overlay.png --stats build/preview.json

# One compiler fills one core: two at a time. What the wheel needs is installed before, so that the wheel, which takes longest, is
# begun first: make would give its place to whatever stands ready. pytest takes all cores by itself.
# ALSO is what else to do beside the checks.
test: | test-machine
	@$(MAKE) --no-print-directory --jobs=2 $(VENV)/.tests any-blender
	@$(MAKE) --no-print-directory --jobs=2 READY=$(VENV)/.tests types test-harness test-rust lint lint-harness \
		test-neon test-loom $(ALSO)
	@$(MAKE) --no-print-directory test-python

# What was measured on these sources before is not measured again; BENCH=--help says more.
bench: $(VENV)/.tests $(VENV)/.bihtree
	@$(BIN)/python -m benchmarks $(BENCH)

bench-quick: $(VENV)/.tests
	@$(BIN)/python -m benchmarks --quick

tables: $(VENV)/.tests $(VENV)/.bihtree
	@$(BIN)/python -m benchmarks.slides $(TABLES)

report: $(VENV)/.tests $(VENV)/.bihtree
	@$(BIN)/python -m addon.blender.command_line report $(REPORT) --output build/report

lint: $(VENV)/.tests | test-machine
	$(BIN)/ruff check --quiet .
	$(BIN)/ruff format --quiet --check .
	cd native && cargo fmt --check
	cd native && cargo clippy --quiet --locked --all-targets -- --deny warnings

lint-harness: | test-machine
	cd benchmarks/harness && cargo fmt --check
	cd benchmarks/harness && cargo clippy --quiet --locked --all-targets --target-dir $(HARNESS) -- --deny warnings

types: $(VENV)/.tests $(VENV)/.bihtree
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest bihtree

# What runs for seconds is compiled unoptimised, which is quick, with debug assertions and checks of overflow.
test-rust: | test-machine
	cd native && cargo test --quiet --locked --lib
	cd native && cargo test --quiet --locked --profile checks --test '*'

# As it is measured: the tests in Python run it.
test-harness: | test-machine
	cd benchmarks/harness && cargo test --quiet --locked --release --target-dir $(HARNESS)

# An emulated ARM processor, AddressSanitizer, Miri, loom: where one is missing it is said; with CI set it is an error.
test-neon test-address test-miri test-loom: test-%: | test-machine
	@"$(PYTHON)" tools/native_checks.py $*

test-memory: test-address test-miri

SECONDS := 60
fuzz:
	@"$(PYTHON)" tools/fuzz.py $(SECONDS)

# As many processes as cores: products of matrices that NumPy spread over all cores would have these wait for one another.
test-python: export OPENBLAS_NUM_THREADS := 1
test-python: $(VENV)/.tests $(VENV)/.bihtree any-blender
	$(BIN)/python -m pytest --quiet --numprocesses=auto --dist=worksteal tests

# The tests say of themselves what they skip where there is no real Blender; with CI set they fail instead.
any-blender: machine
	@"$(PYTHON)" tools/real_blender.py > /dev/null || true

test-hosts: $(VENV)/.tests $(VENV)/.bihtree
	@$(BIN)/python tools/hosts.py $(HOSTS)

stress: export BIHTREE_STRESS := 1
stress: export BIHTREE_EXAMPLES := 5000
stress: export PROPTEST_CASES := 20000
stress: $(VENV)/.tests $(VENV)/.bihtree
	$(BIN)/python -m pytest --quiet tests/cases tests/native/test_integer_lattice.py tests/native/test_oracle.py
	$(BIN)/python -m pytest --quiet tests/blender/test_bad_input.py tests/blender/test_viewport.py
	$(BIN)/python -m tests.sweep_table build/stress
	cd native && cargo test --quiet --locked --profile checks --package bih-core --test agreement
	@$(MAKE) --no-print-directory mutations

mutations: $(VENV)/.tests
	@$(BIN)/python tools/mutations.py

package: $(VENV)/.tests
	@$(BIN)/python tools/package.py $(PLATFORM)

real-blender: machine
	@"$(PYTHON)" tools/real_blender.py

format: $(VENV)/.tests
	$(BIN)/ruff check --quiet --fix .
	$(BIN)/ruff format --quiet .
	cd native && cargo fmt
	cd benchmarks/harness && cargo fmt

UV_COMPILE = $(BIN)/uv pip compile --quiet --universal --generate-hashes --no-annotate --custom-compile-command "make lock"
lock: $(VENV)/.tests
	for name in requirements requirements-addon requirements-dev tests/hosts/blender-4.2 tests/hosts/blender-4.5; do \
		$(UV_COMPILE) --python-version 3.11 --output-file $$name.lock $$name.in; done
	$(UV_COMPILE) --python-version 3.13 --output-file tests/hosts/blender-5.2.lock tests/hosts/blender-5.2.in

clean:
	rm -rf build native/target benchmarks/harness/target

machine:
	@test -n "$(PYTHON)" || { echo "$(NO_PYTHON)" >&2; exit 1; }
	@"$(PYTHON)" tools/check_machine.py

test-machine:
	@test -n "$(PYTHON)" || { echo "$(NO_PYTHON)" >&2; exit 1; }
	@"$(PYTHON)" tools/check_machine.py --tests

# Three steps of one environment, each marked when it is done: what a preview needs, what the tests need, bihtree.
$(VENV)/.python: requirements.lock | machine
	@echo "Installing Blender as a Python module and what it needs into $(VENV) (once; 400 MB)"
	@"$(PYTHON)" -m venv $(VENV)
	@$(PIP_INSTALL) --require-hashes --requirement requirements.lock
	@touch $@

$(VENV)/.tests: requirements-dev.lock $(VENV)/.python
	@echo "Installing what the tests need into $(VENV)"
	@$(PIP_INSTALL) --require-hashes --requirement requirements-dev.lock
	@touch $@

# A wheel for this machine alone, so nobody need check what else it would run on. Where the tests are installed it is the one
# of the zip, so that it is what they test and is compiled once; READY is what else must be there first.
$(VENV)/.bihtree: $(NATIVE) $(VENV)/.python | $(READY)
	@echo "Building bihtree (four minutes or so)"
	@rm -rf build/wheels
	@if [ -e $(VENV)/.tests ]; then $(BIN)/python tools/package.py --wheel build/wheels; else \
		$(BIN)/maturin build --manifest-path native/bih-python/Cargo.toml --release --locked --auditwheel skip \
			--out build/wheels; fi > build/bihtree.log 2>&1 || { cat build/bihtree.log >&2; exit 1; }
	@$(PIP_INSTALL) --no-deps --no-index --force-reinstall build/wheels/*.whl
	@touch $@
