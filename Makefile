# Two commands do everything on a fresh machine: `make demo` and `make test`.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.ready
DEMO   := demo-result

SERVE_DEMO := demo-service
SERVE_PORT ?= 8000

.PHONY: demo serve-demo test check audit format bench experiments soak lock clean

demo: $(READY)  ## simulate a small building, map it, print the table and where the report is
	$(BIN)/radioslam simulate office --out $(DEMO)/walks --seed 1 --force
	$(BIN)/radioslam map $(DEMO)/walks --starts common --out $(DEMO)/map --force

serve-demo: $(READY)  ## start the service, replay a simulated crowd, print the address; Ctrl-C ends it
	$(BIN)/radioslam serve-demo --data $(SERVE_DEMO) --port $(SERVE_PORT)

test: $(READY)  ## the whole test suite
	$(BIN)/python -m pytest -n 2 --dist worksteal

check: $(READY)  ## format, lint, types, known vulnerabilities
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python .ci/audit.py

audit: $(READY)  ## known vulnerabilities in the locked dependencies, where somebody can be asked
	$(BIN)/python .ci/audit.py

format: $(READY)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(READY)  ## speed as a ratio to a named reference, in one run
	$(BIN)/python -m benchmarks

experiments: $(READY)  ## run every experiment of docs/results.md again and renew its tables
	$(BIN)/python -m benchmarks.results
	$(BIN)/python -m benchmarks.figures

soak: $(READY)  ## the service's long trials: 100 kills, 10,000 mangled requests, 300 phones, speed
	$(BIN)/python -m tests.soak

lock:  ## renew requirements.lock from pyproject.toml (needs uv)
	uv pip compile pyproject.toml --all-extras --group dev --universal --python-version 3.11 \
	  --generate-hashes --no-emit-index-url --no-emit-find-links --no-header -q -o requirements.lock

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "RadioSLAM needs Python 3.11 or newer, found " + sys.version.split()[0] + "; try: make PYTHON=python3.11")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps -e .
	@touch $@

clean:
	rm -rf $(VENV) $(DEMO) $(SERVE_DEMO) .pytest_cache .mypy_cache .ruff_cache .hypothesis
