# Everything sets itself up in .venv; a second run rebuilds only what changed.
#
#   make demo    a part with a lattice, measured and drawn, in demo/
#   make test    the core's tests and the Python tests
#   make campaign  thousands of random designs and damaged meshes instead of dozens, every damage in every part
#   make bench   our command beside other tools (those that are installed)
#   make tidy    formatters and linters
#   make studio  the studio, one page with the core as WebAssembly: build/studio/index.html, and for the next package
#   make docs    remakes the generated pages and figures under docs/
#   make site    the pages as a site in build/site
#   make wheels  packages for other machines in build/dist, with the studio
#   make blender  the extension for Blender in build/blender
#
# PYTHON names the interpreter that .venv is made from (3.10 or newer). PROFILE names the build that the Python tests run
# on: `checked`, which has the core in common with the core's tests, or `release`, the wheel that is handed out.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip --disable-pip-version-check --quiet
EDGE   ?= 0.18
PROFILE ?= checked
PYTEST := $(BIN)/python -m pytest -q -n auto

export PYO3_PYTHON := $(abspath $(BIN)/python)

SOURCES := Cargo.toml Cargo.lock pyproject.toml $(wildcard schema/*.json) \
    $(shell find crates python -type f -not -path '*/tests/*' -not -path 'crates/trabecula-wasm/*' -not -path '*/__pycache__/*' \
      \( -name '*.rs' -o -name '*.toml' -o -name '*.py' -o -name '*.pyi' -o -name '*.js' -o -name '*.css' -o -name studio.html \
         -o -name py.typed \))

.PHONY: all demo test campaign core-test python-test docs-test bench smoke tidy studio docs site wheels blender clean
.DELETE_ON_ERROR:

all: $(VENV)/.release

# --- set-up -----------------------------------------------------------------------------------------------------------

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || { \
	  echo "Trabecula needs Python 3.10 or newer; '$(PYTHON)' is missing or older."; \
	  echo "Name another one: make PYTHON=/path/to/python3.12"; exit 1; }
	@command -v cargo >/dev/null || { \
	  echo "Trabecula's core is written in Rust and 'cargo' was not found."; \
	  echo "Install Rust 1.88 or newer and run this again."; exit 1; }
	@$(PYTHON) -m venv --clear $(VENV) || { \
	  echo "Could not make $(VENV). On Debian and Ubuntu the package python3-venv is needed."; exit 1; }
	@echo "setting up $(VENV)"
	@$(PIP) install 'maturin>=1.9,<2' 'numpy>=1.24'
	@touch $@

build/.wheel-release build/.wheel-checked: build/.wheel-%: $(VENV)/.made $(SOURCES)
	@echo "building the package ($*)"
	@rm -rf build/wheels-$* && mkdir -p build
	@$(BIN)/maturin build --quiet --profile $* --interpreter $(BIN)/python --out build/wheels-$*
	@touch $@

# One of the two is installed at a time.
$(VENV)/.release $(VENV)/.checked: $(VENV)/.%: build/.wheel-%
	@rm -f $(VENV)/.release $(VENV)/.checked
	@$(PIP) install --force-reinstall --no-deps build/wheels-$*/trabecula-*.whl
	@$(PIP) install build/wheels-$*/trabecula-*.whl
	@touch $@

$(VENV)/.test-tools: $(VENV)/.$(PROFILE) pyproject.toml
	@$(PIP) install "$$(echo build/wheels-$(PROFILE)/trabecula-*.whl)[test]"
	@touch $@

$(VENV)/.ruff: $(VENV)/.made
	@$(PIP) install 'ruff>=0.8'
	@touch $@

# Wheels of Linux to hand out, in build/dist: glibc from 2.17 and musl from 1.2 on, linked by zig. One serves Python 3.10 and later.
# They have the studio's page, which whoever installs a wheel cannot make.
TARGETS ?= x86_64-unknown-linux-gnu aarch64-unknown-linux-gnu x86_64-unknown-linux-musl aarch64-unknown-linux-musl

wheels: $(addprefix build/dist/.,$(TARGETS))
	@ls -l build/dist

build/dist/.%: $(VENV)/.zig $(SOURCES) build/studio/index.html scripts/check_wheels.py
	@command -v rustup >/dev/null && rustup target add $* || echo "rustup is missing; the Rust of this system has to have $*"
	PATH="$(abspath $(BIN)):$$PATH" maturin build --quiet --release --zig --target $* --interpreter python3.10 --out build/dist \
	  --compatibility $(if $(findstring musl,$*),musllinux_1_2,manylinux2014)
	@$(BIN)/python scripts/check_wheels.py build/dist/trabecula-*.whl
	@touch $@

$(VENV)/.zig: $(VENV)/.made
	@$(PIP) install 'maturin[zig]>=1.9,<2'
	@touch $@

# The extension for Blender, with the wheels that there are in build/dist.
blender: build/dist/.x86_64-unknown-linux-gnu
	$(BIN)/python scripts/blender_extension.py

# --- the demo ---------------------------------------------------------------------------------------------------------

DEMO := examples/hip_stem.toml
PART := examples/parts/hip_stem.stl

demo: demo/hip_stem.png
	@cat demo/summary.txt

demo/hip_stem.png: $(VENV)/.release $(DEMO) $(PART) scripts/demo_summary.py
	@mkdir -p demo
	$(BIN)/trabecula check $(DEMO)
	$(BIN)/trabecula mesh $(DEMO) -o demo/hip_stem.3mf --edge $(EDGE)
	$(BIN)/trabecula mesh $(DEMO) -o demo/hip_stem.stl --edge $(EDGE)
	$(BIN)/trabecula measure demo/hip_stem.stl --region $(PART) --json > demo/report.json
	$(BIN)/trabecula render demo/hip_stem.stl -o demo/hip_stem.part.png
	@$(BIN)/python scripts/demo_summary.py demo > demo/summary.txt
	@mv demo/hip_stem.part.png $@

# --- the studio -------------------------------------------------------------------------------------------------------

WASM := target/wasm/wasm32-unknown-unknown/release/trabecula_wasm.wasm
STUDIO_SOURCES := $(shell find crates -type f -not -path '*/tests/*' \( -name '*.rs' -o -name '*.toml' \)) \
    crates/trabecula-wasm/Cargo.lock

studio: build/studio/index.html

$(WASM): $(STUDIO_SOURCES)
	@rustc --target wasm32-unknown-unknown --print target-libdir 2>/dev/null | xargs test -d || \
	  rustup target add wasm32-unknown-unknown || { \
	  echo "The studio's page, which wheels to hand out have, needs Rust's target wasm32-unknown-unknown, and rustup could not"; \
	  echo "add it; the Rust of this system has to have it."; exit 1; }
	@echo "building the core as WebAssembly (minutes)"
	@RUSTFLAGS="-C link-arg=-zstack-size=4194304 -C target-feature=+simd128" cargo build --quiet --locked --release \
	  --manifest-path crates/trabecula-wasm/Cargo.toml --target wasm32-unknown-unknown --target-dir target/wasm
	@touch $@

build/studio/index.html: $(WASM) scripts/studio_page.py $(wildcard studio/*) python/trabecula/pictures/viewer.js python/trabecula/pictures/viewer.css
	@$(PYTHON) scripts/studio_page.py $(WASM) python/trabecula/command/studio.html $@

# The pages of docs/ as a site in build/site: search needs a server, such as `python -m http.server -d build/site`.
site: $(VENV)/.site
	$(BIN)/python scripts/site_pages.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict

$(VENV)/.site: $(VENV)/.made
	@$(PIP) install 'mkdocs>=1.6,<2' 'mkdocs-material>=9.5,<10'
	@touch $@

# --- checks -----------------------------------------------------------------------------------------------------------

test: core-test python-test docs-test

# The same random cases in every run; `make campaign` and a plain `cargo test` draw new ones.
core-test: $(VENV)/.made
	PROPTEST_RNG_SEED=1 cargo test --profile checked --locked --workspace

CASES ?= 2000
campaign: $(VENV)/.test-tools
	TRABECULA_CASES=$(CASES) cargo test --profile checked --locked -p trabecula --test laws surface::random
	TRABECULA_CASES=$(CASES) cargo test --profile checked --locked -p trabecula --test laws -- damage flush --nocapture
	TRABECULA_CASES=$$(($(CASES) / 5)) cargo test --profile checked --locked -p trabecula --test laws -- combined --nocapture
	TRABECULA_CASES=$$(($(CASES) / 10)) cargo test --profile checked --locked -p trabecula --test laws -- skin:: islands::
	TRABECULA_CASES=$$(($(CASES) / 50)) cargo test --profile checked --locked -p trabecula --test laws -- \
	  cores:: crease:: disclinations:: measured:: noisy_stress:: patches:: periodic_cells:: pore:: shells:: simplify:: smooth:: \
	  spacing:: stretch:: tets thickness:: tiling volume_angles:: wavelength::
	TRABECULA_CAMPAIGN=1 $(PYTEST) tests/test_parts.py tests/test_laws.py tests/test_corpus.py tests/test_ranges.py

python-test: $(VENV)/.test-tools
	$(PYTEST) tests --ignore tests/test_docs.py

docs-test: $(VENV)/.test-tools
	$(PYTEST) tests/test_docs.py

tidy: $(VENV)/.ruff
	@if cargo fmt --version >/dev/null 2>&1; then echo "cargo fmt"; cargo fmt --all --check && \
	  cargo fmt --manifest-path crates/trabecula-wasm/Cargo.toml --check; \
	  else echo "NOT CHECKED: rustfmt is not installed (rustup component add rustfmt)"; fi
	@if cargo clippy --version >/dev/null 2>&1; then echo "cargo clippy"; \
	  cargo clippy --quiet --locked --workspace --all-targets -- -D warnings; \
	  else echo "NOT CHECKED: clippy is not installed (rustup component add clippy)"; fi
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

smoke: $(VENV)/.$(PROFILE)
	$(BIN)/python bench/smoke.py --trabecula $(BIN)/trabecula

bench: $(VENV)/.release
	$(BIN)/python bench/peers.py --trabecula $(BIN)/trabecula --record
	$(BIN)/python bench/parts.py --trabecula $(BIN)/trabecula
	$(BIN)/python bench/beams.py --trabecula $(BIN)/trabecula
	$(BIN)/python bench/tets.py --trabecula $(BIN)/trabecula

docs: $(VENV)/.release
	$(BIN)/python scripts/figure_porosity.py
	$(BIN)/python scripts/cell_tables.py
	$(BIN)/python scripts/tetcell_tables.py
	$(BIN)/python scripts/thickness_accuracy.py
	$(BIN)/python scripts/turning_tables.py
	$(BIN)/python scripts/blend_tables.py
	$(BIN)/python scripts/blend_by_normal_scores.py
	$(BIN)/python scripts/beam_tables.py
	$(BIN)/python scripts/gallery.py
	$(BIN)/python scripts/pictures.py
	$(BIN)/python scripts/builders.py
	$(BIN)/python scripts/design_page.py
	$(BIN)/python scripts/design_reference.py

clean:
	rm -rf build demo $(VENV)
