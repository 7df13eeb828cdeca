# `make demo` and `make test` set up all they need, in a virtual environment of their own.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo benchmark cards test kernels lint wheel docs notebook proofs accuracy studies coverage mutants same nonsense bounds fuzz floors pythons ptx ray rllib libraries urls clean

ALL := --constraint constraints.txt --editable '.[agents,app,control,data,design,diagnosis,dev,docs,onboard,parquet,pettingzoo,render]'
$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' || \
	  { echo "Python 3.11 to 3.13 is needed; name one: make PYTHON=python3.12 ..."; exit 1; }
	@echo "Installing into $(VENV), which takes minutes."
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/pip install --quiet --no-compile --constraint constraints.txt torch uv
	@$(BIN)/uv pip install --quiet --python $(BIN)/python $(ALL) || $(BIN)/pip install -qq $(ALL) # which knows pip's own settings
	@touch $@

# Validation, two agents trained for a quarter of a minute each, and the benchmark of all policies.
DEMO := runs/demo
demo: $(READY)
	@rm -rf $(DEMO)
	@$(BIN)/panto validate --brief
	$(BIN)/panto train configs/ppo-quick.toml --output $(DEMO)/ppo-en50318
	$(BIN)/panto train configs/ppo-quick-shinkansen.toml --output $(DEMO)/ppo-shinkansen
	$(BIN)/panto benchmark --config configs/demo.toml --output $(DEMO)/benchmark.json \
	  --html $(DEMO)/benchmark.html
	@echo "The page is $(DEMO)/benchmark.html; every figure is in $(DEMO)/benchmark.json."

# All tracks of the benchmark, with the agents that come with the project, the page of all, and the documents' tables.
TRACKS := any-line train-trailing train-both known-line as-built without-position head high-speed high-speed-as-built unknown-line unknown-section faults margins long journey permissible
RESULTS := docs/benchmark
benchmark: $(READY)
	mkdir -p $(RESULTS)
	for track in $(TRACKS); do \
	  $(BIN)/panto benchmark --config benchmark/$$track --trusted --output $(RESULTS)/$$track.json.gz --force || exit 1; done
	$(BIN)/panto report $(TRACKS:%=$(RESULTS)/%.json.gz) --output $(RESULTS)/index.html
	$(BIN)/python -m tests.benchmark_tables

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# Bytecode is kept whatever the environment says: tests start more than a hundred processes.
test proofs: export PYTHONDONTWRITEBYTECODE =

# CI runs the longer tests too.
QUICK := not slow and not study
TESTS := $(QUICK) and not longer
test: $(READY)
	$(MAKE) -j 2 lint kernels
	$(BIN)/pytest -n auto --dist loadfile -m '$(TESTS)'

# The usual kernels, beside the lint, which leaves a core idle.
kernels: $(READY)
	$(BIN)/python -m tests.known_kernels

# A wheel that brings the usual kernels, compiled for x86-64-v3: the first step takes seconds. One version of Python each.
wheel: $(READY)
	$(BIN)/python -m tests.known_kernels --wheel dist

# The documentation as a site, warnings as errors. `make proofs` builds it too, and follows every link within it.
SITE := docs/_build/html
docs: $(READY)
	$(BIN)/sphinx-build -W --keep-going -n -q -b html docs $(SITE)
	@echo "The site is $(SITE)/index.html; it needs no network."

# The cards of the stored agents, after a benchmark or a change of docs/agents.md.
cards: $(READY)
	$(BIN)/python -m tests.cards

# The notebooks of the examples, run anew; what they print and draw is stored in them.
notebook: $(READY)
	$(BIN)/python -m tests.notebook

# The films that the documentation shows.
REAL := --actuator realistic --sensors realistic
SMALL := --seconds 2.4 --size 800 450
films: $(READY)
	mkdir -p docs/films
	$(BIN)/panto film passive agent-known-line $(REAL) --line-condition fair --seconds 2.4 --size 880 660 \
	  --output docs/films/passive-and-agent.mp4
	$(BIN)/panto film passive agent-known-line $(REAL) --line-condition fair --seconds 1.44 --slow-motion 2 --size 800 600 \
	  --output docs/films/passive-and-agent.gif
	$(BIN)/panto film agent-known-line $(REAL) --line-condition as-built $(SMALL) --output docs/films/pantograph.mp4
	$(BIN)/panto film pd --catenary periodic-stiffness --pantograph three-mass $(SMALL) \
	  --output docs/films/pantograph-stiffness.mp4
	$(BIN)/panto film pd --catenary ohl-three-span --pantograph own-two-mass $(SMALL) \
	  --output docs/films/pantograph-three-span.mp4

# The project's address in what is published, once it has one: `make urls URL=https://...`.
PLACEHOLDER := https://example.org/panto-env
urls:
	@test -n "$(URL)" || { echo "Name the address: make urls URL=https://..."; exit 1; }
	sed -i 's|$(PLACEHOLDER)|$(URL)|; s|^# Placeholders:.*||' pyproject.toml CITATION.cff examples/*.ipynb

# Slow proofs: more lines against finite elements, longer trainings, random environments, and, from the command line only,
# COMMANDS=, NONSENSE= and FILES= of command lines, lines and damaged files. They take the best part of an hour on two
# cores; PART=0/20 runs a twentieth of them.
CASES := 2000
PART := 0/1
proofs: $(READY)
	CASES=$(CASES) $(BIN)/pytest -n auto --dist worksteal -m slow --part $(PART)

# Studies of minutes each: papers 1 and 2 against what the documents say of them, learning from whole data sets, and most
# sections, trains and gusts beside finite elements.
studies: $(READY)
	$(BIN)/pytest -n auto --dist worksteal -m study

# Errors of the default grid, step and window on the catalogue's lines and twenty drawn ones, at all speeds.
accuracy: $(READY)
	$(BIN)/panto validate --lines --window

# Coverage of the kernels, which run as plain Python for it: a chosen quick set of tests.
coverage: $(READY)
	NUMBA_DISABLE_JIT=1 $(BIN)/coverage run -m pytest -q -m 'plain and $(QUICK)'
	$(BIN)/coverage report

# Share of generated mutants that the tests notice, room by room; ROOMS= for some of the rooms.
MUTANTS := .venv-mutants
SAMPLE := 200
SEED := 1
ROOMS :=
mutants: $(READY)
	$(PYTHON) -m venv $(MUTANTS)
	$(MUTANTS)/bin/pip install -qq --constraint constraints.txt cosmic-ray==8.7.0 coverage
	$(MUTANTS)/bin/python -m tests.mutants $(ROOMS) --sample $(SAMPLE) --seed $(SEED) --python $(abspath $(BIN)/python)

# Results and speed beside those of an earlier commit: make same BEFORE=1cef35a
same: $(READY)
	$(BIN)/python -m tests.before.compare --before $(BEFORE)
	$(BIN)/python -m tests.before.speed --before $(BEFORE)

# Thousands of random lines, pantographs and speeds: each refused, or finite, balanced and nearly converged; and of random
# designs: each run, or refused in a sentence.
NONSENSE := 3000
DESIGNS := 2000
nonsense: $(READY)
	NONSENSE=$(NONSENSE) $(BIN)/pytest -s -m slow tests/plant/test_nonsense.py
	DESIGNS=$(DESIGNS) $(BIN)/pytest -s -m slow -k random tests/studies/test_design.py

# Every index of whole episodes and random lines checked against its array.
bounds: $(READY)
	$(BIN)/pytest tests/backend/test_bounds_checked.py

# Bad command lines, random environments, damaged files, and minutes of everything: each end is judged and counted.
FILES := 10000
COMMANDS := 2000
fuzz: $(READY)
	COMMANDS=$(COMMANDS) CASES=$(CASES) FILES=$(FILES) MINUTES=5 $(BIN)/pytest -s -m 'slow or study' tests/fuzz

# The lower bounds of pyproject.toml, all at once, without the extra 'agents'; what they need themselves is the
# newest that there is. The versions tested are in constraints.txt.
FLOORS := .venv-floors
FLOOR_EXTRAS := control,diagnosis,parquet,pettingzoo,render
floors:
	$(PYTHON) -m venv $(FLOORS)
	$(FLOORS)/bin/pip install -qq --upgrade pip packaging
	$(FLOORS)/bin/python -m tests.floors $(FLOOR_EXTRAS) > $(FLOORS)/floors.txt
	$(FLOORS)/bin/pip install -q --constraint $(FLOORS)/floors.txt pytest pytest-xdist --editable ".[$(FLOOR_EXTRAS)]"
	$(FLOORS)/bin/pytest -n auto --dist worksteal -m '$(TESTS)' tests/cli/test_cli.py tests/envs/test_env.py tests/envs/test_trains.py tests/envs/test_vector.py tests/envs/test_gymnasium_rules.py \
	  tests/envs/test_vector_rules.py tests/analysis/test_sweep.py tests/analysis/test_plots.py tests/metrics/test_trajectory.py tests/render/test_render.py

# Every version of Python that is supported and at hand, but the first one, without the extra 'agents'.
PYENV = $(shell pyenv root 2> /dev/null)
FOUND = python3.12 python3.13 $(wildcard $(PYENV)/versions/3.1[23].*/bin/python3.1[23])
PYTHONS = $(foreach python,$(FOUND),$(shell $(python) -c '' 2> /dev/null && echo $(python)))
pythons:
	@test -n "$(PYTHONS)" || echo "There is no Python 3.12 or 3.13 here, so none is tested; name them: make pythons PYTHONS=..."
	for python in $(PYTHONS); do \
	  venv=.venv-$$(basename $$python); \
	  $$python -m venv $$venv && \
	  $$venv/bin/pip install -qq --constraint constraints.txt pytest pytest-xdist --editable '.[control,render]' && \
	  $$venv/bin/pytest -n auto --dist worksteal -m '$(TESTS)' tests/envs/test_env.py tests/envs/test_vector.py tests/envs/test_gymnasium_rules.py tests/baselines/test_baselines.py \
	    || exit 1; done

# The kernels' source compiled for a GPU, without one: NVIDIA's compiler in an environment of its own.
PTX := .venv-ptx
ptx:
	$(PYTHON) -m venv $(PTX)
	$(PTX)/bin/pip install -qq --constraint constraints.txt torch
	$(PTX)/bin/pip install -qq --constraint constraints.txt numba-cuda==0.30.4 nvidia-cuda-nvrtc==13.5.37 \
	  nvidia-nvvm==13.5.37 nvidia-cuda-cccl==13.3.5.0.6 pytest --editable .
	$(PTX)/bin/pytest tests/backend/test_ptx.py

# Benchmark, tuning and trainings on a Ray cluster of two nodes, which both are this machine.
RAY := .venv-ray
ray:
	$(PYTHON) -m venv $(RAY)
	$(RAY)/bin/pip install -qq --constraint constraints.txt torch
	$(RAY)/bin/pip install -qq --constraint constraints.txt pytest --editable '.[agents,ray]'
	$(RAY)/bin/pytest tests/cluster/test_ray.py

# RLlib trains on the native vector environment; it pins a Gymnasium of its own.
RLLIB := .venv-rllib
rllib:
	$(PYTHON) -m venv $(RLLIB)
	$(RLLIB)/bin/pip install -qq --constraint constraints.txt torch
	$(RLLIB)/bin/pip install -qq 'ray[rllib]==2.60.0' pytest --editable .
	$(RLLIB)/bin/pytest tests/envs/test_rllib.py

# TorchRL, Tianshou, skrl and Minari on the environments; Tianshou wants an older filelock.
LIBRARIES := .venv-libraries
libraries:
	$(PYTHON) -m venv $(LIBRARIES)
	grep -v '^filelock==' constraints.txt > $(LIBRARIES)/constraints.txt
	$(LIBRARIES)/bin/pip install -qq --constraint $(LIBRARIES)/constraints.txt torch
	$(LIBRARIES)/bin/pip install -qq --constraint $(LIBRARIES)/constraints.txt torchrl==0.14.1 tianshou==2.0.1 skrl==2.1.1 \
	  'minari[create,hdf5]==0.5.4' pytest --editable .
	$(LIBRARIES)/bin/pytest tests/envs/test_libraries.py

clean:
	rm -rf $(VENV) $(FLOORS) .venv-python3.* $(PTX) $(RAY) $(RLLIB) $(LIBRARIES) $(MUTANTS) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
