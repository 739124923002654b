# Thin: each target is a script or a preset. `make help` lists them.
JOBS ?= $(shell nproc)
BUILD := build/release

ifneq ($(shell command -v ccache),)
LAUNCHER := -DCMAKE_CXX_COMPILER_LAUNCHER=ccache
export CCACHE_SLOPPINESS := pch_defines,time_macros
export CCACHE_BASEDIR := $(CURDIR)
endif

.PHONY: help demo test build bench fuzz format format-check lint docs install clean configure
.DEFAULT_GOAL := help

help:  ## Show this list
	@sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 22

demo:  ## Install what is missing, build the command, tune an example log
	@scripts/install-deps
	@$(MAKE) --no-print-directory configure TESTS=$(if $(wildcard $(BUILD)/CMakeCache.txt),,OFF)
	@cmake --build $(BUILD) --parallel $(JOBS) --target flyball_command example_true_versus_identified
	@scripts/demo

test:  ## Install what is missing, build everything, run every test
	@$(MAKE) --no-print-directory build
	@ctest --preset release --parallel $(JOBS)

build:  ## Install what is missing, build everything
	@scripts/install-deps --dev
	@$(MAKE) --no-print-directory configure
	@cmake --build $(BUILD) --parallel $(JOBS)

bench:  ## Build and run the benchmarks: ratios against named peers
	@scripts/install-deps --dev
	@scripts/bench $(JOBS)

fuzz:  ## Fuzz every reader and kernel; SECONDS=... for each target
	@scripts/install-deps --dev
	@scripts/fuzz $(if $(SECONDS),--seconds $(SECONDS))

format:  ## Format every C++ file
	@scripts/install-deps --dev
	@scripts/format

format-check:  ## Fail if a C++ file is not formatted
	@scripts/install-deps --dev
	@scripts/format --check

lint:  ## clang-tidy over all sources; CHANGED=1: only what differs from main
	@scripts/install-deps --dev
	@scripts/lint $(if $(CHANGED),--changed)

docs:  ## The guide and the pages of the public headers, in docs/html
	@scripts/install-deps --dev
	@$(MAKE) --no-print-directory configure TESTS=
	@cmake --build $(BUILD) --parallel $(JOBS) --target flyball_command flyball_guide_examples
	@scripts/docs

install: build  ## Install library and command; PREFIX=... says where
	@cmake --install $(BUILD) $(if $(PREFIX),--prefix $(PREFIX))

clean:  ## Remove what was built
	@rm -rf build docs/html

# The tests need packages that the demo does without; TESTS= leaves them as they were.
TESTS = ON
configure:
	@cmake --preset release --log-level=WARNING $(LAUNCHER) \
	  -DFLYBALL_BUILD_APPS=ON -DFLYBALL_BUILD_EXAMPLES=ON $(if $(TESTS),-DFLYBALL_BUILD_TESTS=$(TESTS))
