# The front door: `make world=office robots=3` sets everything up and runs the main job; `make help` lists the rest.

# Set with =, so that a variable of the same name in the environment does not leak in; the command line still wins.
world    = office
robots   = 3
seed     = 6
duration = 120
noise    = 1
method   = quilt
cases    = 2700
out      = runs/$(world)-$(robots)-$(seed)
PYTHON   = $(or $(shell command -v python3.11 2>/dev/null),python3)

variables = world robots seed duration noise method cases out PYTHON

# --- What stands on make's command line: known names only, and values that stay values ----------------------------------
define newline


endef
given    := $(strip $(foreach v,$(.VARIABLES),$(if $(filter command,$(firstword $(origin $v))),$v)))
unknown  := $(filter-out $(variables),$(given))
broken   := $(strip $(foreach v,$(given),$(if $(findstring $(newline),$(value $v)),$v)))
$(if $(unknown),$(error unknown variable $(firstword $(unknown)); known are: $(variables)))
$(if $(broken),$(error the value of $(firstword $(broken)) holds a line break))
$(foreach v,$(given),$(eval override $v := $$(value $v)))

quote = '$(subst ','\'',$1)'

# --- Setting up ----------------------------------------------------------------------------------------------------------
bin   = .venv/bin
stamp = .venv/.installed
pip   = $(bin)/python -m pip --disable-pip-version-check --quiet

found_python = $(shell $(call quote,$(PYTHON)) -c 'import platform; print(platform.python_version())' 2>/dev/null)
check_python = $(if $(filter 3.11.%,$(found_python)),,$(error mapquilt needs Python 3.11, but $(PYTHON) \
is $(if $(found_python),Python $(found_python),not a Python that runs); name one with PYTHON=/path/to/python3.11))

# --- The job -------------------------------------------------------------------------------------------------------------
define simulate
$(bin)/mapquilt simulate $(call quote,$(world)) --robots $(call quote,$(robots)) --seed $(call quote,$(seed)) \
  --duration $(call quote,$(duration)) --noise $(call quote,$(noise)) --out $(call quote,$(out))
endef
# A method that does not exist stops the job before the run of before is replaced.
check_method = $(bin)/mapquilt merge $(call quote,$(out)) --method $(call quote,$(method)) --dry-run
# Exit status 1 says that some map was refused: a result, to be scored like any other.
merge = $(bin)/mapquilt merge $(call quote,$(out)) --method $(call quote,$(method)) || test $$? -eq 1
score = $(bin)/mapquilt score $(call quote,$(out))

# sim and merge are also folders.
.PHONY: run sim merge score thesis thesis-quick install test test-fast test-bounds fuzz regression regression-update check docs release-check study \
  bench crash lock clean help
.DEFAULT_GOAL = run
.DELETE_ON_ERROR:

run: $(stamp)
	$(check_method)
	$(simulate)
	$(merge)
	$(score)

sim: $(stamp)
	$(simulate)

merge: $(stamp)
	$(merge)

score: $(stamp)
	$(score)

thesis: $(stamp)
	$(bin)/python -m reproductions.chen2021 --out runs/thesis --workers 2

thesis-quick: $(stamp)
	$(bin)/python -m reproductions.chen2021 --out runs/thesis-quick --seeds 2 --workers 2

install: $(stamp)

$(stamp): requirements.lock pyproject.toml
	$(check_python)@echo "Installing into .venv; once, and it takes a minute or two."
	@$(call quote,$(PYTHON)) -m venv .venv
	@$(pip) install --require-hashes --no-deps -r requirements.lock
	@$(pip) install --no-index --no-deps --no-build-isolation --editable .
	@touch $@

# The rooms whose tests are laws, known answers and refusals of single functions.
laws = tests/mapping tests/worlds tests/merge tests/sim tests/mapquilt/evaluation

# --- Working on mapquilt ---------------------------------------------------------------------------------------------------
test: $(stamp)
	$(bin)/pytest -n 2

test-fast: $(stamp)
	$(bin)/pytest -n 2 -q -m "not slow" $(laws)

# The tests that call compiled loops, with every index checked; the compiler's cache does not tell the two apart.
kernels = tests/mapping/grid tests/mapping/ground_truth tests/mapping/particle tests/mapping/slam tests/merge/alignment \
  tests/merge/literature tests/merge/preparation tests/merge/proposers tests/merge/verification tests/sim/mission \
  tests/sim/navigation tests/sim/sensors

test-bounds: $(stamp)
	NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=build/numba-bounds $(bin)/pytest -n 2 -q -m "not slow" $(kernels)

fuzz: $(stamp)
	FUZZ_CASES=$(call quote,$(cases)) $(bin)/pytest -n 2 -q tests/fuzz

regression: $(stamp)
	$(bin)/python -m tests.regression

regression-update: $(stamp)
	$(bin)/python -m tests.regression --update

check: $(stamp)
	$(bin)/ruff check .
	$(bin)/ruff format --check .
	$(bin)/mypy
	$(bin)/lint-imports

docs: $(stamp)
	NO_MKDOCS_2_WARNING=1 $(bin)/mkdocs build --strict --quiet
	@echo 'build/site/index.html'

release-check: $(stamp)
	.ci/release_check $(bin)/python

crash: $(stamp)
	$(bin)/python -m tests.crash

bench: $(stamp)
	$(bin)/python -m benchmarks.bench

places = office house warehouse maze corridor_loop open_hall

study: $(stamp)
	$(bin)/mapquilt study noise $(foreach place,$(places),--world $(place)) --missions 2 --workers 2 \
	  --cache runs/missions --out runs/study
	$(bin)/mapquilt report runs/study

lock: $(stamp)
	@$(call quote,$(PYTHON)) -m venv .venv/lock
	@.venv/lock/bin/python -m pip --disable-pip-version-check --quiet install "uv>=0.5"
	.venv/lock/bin/uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 --upgrade \
	  --generate-hashes --no-header --no-annotate --output-file requirements.lock --quiet

clean:
	rm -rf .venv build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis

help:
	@echo 'make [run]     simulate a team of robots, merge their maps, score the merge'
	@echo 'make sim, make merge, make score   one step of that, on what the step before left in out'
	@echo 'make thesis    reproduce the study of Chen (2021) in runs/thesis; stopped, it goes on'
	@echo 'make thesis-quick  the same on two pairs of maps for each case, in runs/thesis-quick'
	@echo 'make test      run all tests'
	@echo 'make test-fast run the unit tests, in a minute'
	@echo 'make test-bounds  run the tests of compiled loops with every index checked, in three minutes'
	@echo 'make fuzz      damage files for every reader at random, 100,000 times in all'
	@echo 'make regression         merge generated pairs of all world families, compare with tests/golden'
	@echo 'make regression-update  rewrite tests/golden, and print what changed'
	@echo 'make check     lint, format, types, import contracts'
	@echo 'make study     sweep the noise level: tables, plots and a report in runs/study'
	@echo 'make docs      build the site in build/site'
	@echo 'make release-check      build the wheel and try it on Python 3.11, 3.12 and 3.13'
	@echo 'make bench     measure the cost of each step'
	@echo 'make crash     kill every verb that writes at each change of the disk, and check what is left'
	@echo 'make install   only set up .venv (every verb above does, when needed)'
	@echo 'make lock      pin the newest allowed versions in requirements.lock'
	@echo 'make clean     remove .venv and caches; runs/ stays'
	@echo 'make help      this list'
	@echo ''
	@echo 'Variables, as in  make world=office robots=3'
	@echo '  world=office     the world to explore'
	@echo '  robots=3         how many robots'
	@echo '  seed=6           same seed, same bytes'
	@echo '  duration=120     simulated seconds'
	@echo '  noise=1          sensor noise, 0 for none'
	@echo '  method=quilt     how maps are matched'
	@echo '  cases=2700       damaged files that make fuzz tries with each reader'
	@echo '  out=runs/WORLD-ROBOTS-SEED   where the run goes'
	@echo '  PYTHON=python3.11            the Python to set up with'
