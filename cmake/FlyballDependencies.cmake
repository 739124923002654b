# What Flyball stands on, found at once: whatever is missing is named with its Debian package before
# anything is built.

set(FLYBALL_MISSING "")

# flyball_find(<debian package> <name> [arguments of find_package...])
macro(flyball_find package name)
  find_package(${name} ${ARGN} QUIET)
  if(NOT ${name}_FOUND)
    string(APPEND FLYBALL_MISSING "\n  ${name} ${ARGN}: package ${package}")
  endif()
endmacro()

flyball_find(libeigen3-dev Eigen3 3.4 NO_MODULE)
flyball_find(libexpected-dev tl-expected)
# Inside our sources only; no public header includes them. The numeric domains do without.
if(FLYBALL_BUILD_TEXT)
  flyball_find(libfmt-dev fmt)
  flyball_find(nlohmann-json3-dev nlohmann_json 3.11)
  flyball_find(libtomlplusplus-dev tomlplusplus)
  flyball_find(libc6-dev Threads)
  # Goes into every report's page.
  find_file(FLYBALL_DYGRAPHS dygraphs/dygraph.min.js PATHS /usr/share/javascript)
  if(NOT FLYBALL_DYGRAPHS)
    string(APPEND FLYBALL_MISSING "\n  dygraphs/dygraph.min.js: package libjs-dygraphs")
  endif()
else()
  find_package(fmt QUIET)
endif()
# The texts of errors are formatted by fmt where it is, compiled in; else by a small part of our own.
if(fmt_FOUND)
  set(FLYBALL_WITHOUT_FMT OFF)
else()
  set(FLYBALL_WITHOUT_FMT ON)
endif()
if(FLYBALL_BUILD_APPS)
  flyball_find(libcli11-dev CLI11)
endif()
if(FLYBALL_BUILD_TESTS)
  flyball_find(libgtest-dev GTest)
  flyball_find(librapidcheck-dev rapidcheck)
  flyball_find(python3 Python3 3.11 COMPONENTS Interpreter)
endif()
if(FLYBALL_BUILD_BENCHMARKS)
  flyball_find(libbenchmark-dev benchmark)
endif()
if(FLYBALL_BUILD_FUZZERS)
  include(CheckCXXSourceCompiles)
  set(CMAKE_REQUIRED_FLAGS -fsanitize=fuzzer,address)
  check_cxx_source_compiles(
    "extern \"C\" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long) { return 0; }"
    FLYBALL_HAS_LIBFUZZER)
  unset(CMAKE_REQUIRED_FLAGS)
  if(NOT FLYBALL_HAS_LIBFUZZER)
    string(APPEND FLYBALL_MISSING
           "\n  libFuzzer: packages clang-19 and libclang-rt-19-dev, and the preset fuzz")
  endif()
endif()

if(FLYBALL_MISSING)
  message(FATAL_ERROR "Not installed:${FLYBALL_MISSING}\n"
                      "scripts/install-deps --dev installs what is missing.")
endif()
