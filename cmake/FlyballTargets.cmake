# The habits of every target, in one place.

# Interface target with the project's warnings and sanitizers; private to our own targets, never
# exported, and never an -march flag: Eigen's layout depends on it.
add_library(flyball_options INTERFACE)
target_compile_features(flyball_options INTERFACE cxx_std_20)
target_compile_options(flyball_options INTERFACE -Wall -Wextra -Wpedantic -Wconversion)
# Among the sources of one unit, a local name may be that of something in another source.
if(FLYBALL_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(flyball_options INTERFACE -Wshadow=local)
elseif(NOT FLYBALL_UNITY_BUILD)
  target_compile_options(flyball_options INTERFACE -Wshadow)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # False positives on std::string in g++ 12: https://gcc.gnu.org/bugzilla/show_bug.cgi?id=105651
  target_compile_options(flyball_options INTERFACE -Wno-restrict -Wno-stringop-overflow
                                                   -Wno-array-bounds)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  # The standard library of g++ 12 deprecates what its own std::stable_sort is made of.
  # Eigen's fixed-size vectors are passed within the library alone: no ABI is at stake (-Wpsabi).
  target_compile_options(flyball_options INTERFACE -Wno-deprecated-declarations -Wno-psabi)
endif()
if(FLYBALL_WARNINGS_AS_ERRORS)
  target_compile_options(flyball_options INTERFACE -Werror)
endif()
if(FLYBALL_SANITIZER)
  target_compile_options(flyball_options INTERFACE -fsanitize=${FLYBALL_SANITIZER}
                                                   -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(flyball_options INTERFACE -fsanitize=${FLYBALL_SANITIZER})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    target_compile_options(
      flyball_options
      INTERFACE -fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/cmake/sanitizer-ignorelist.txt)
    if(FLYBALL_SANITIZER MATCHES fuzzer)
      target_compile_options(
        flyball_options
        INTERFACE -fsanitize-coverage-ignorelist=${PROJECT_SOURCE_DIR}/cmake/coverage-ignorelist.txt
      )
    endif()
  endif()
endif()

if(FLYBALL_WITHOUT_FMT)
  target_compile_definitions(flyball_options INTERFACE FLYBALL_WITHOUT_FMT)
endif()

set_property(GLOBAL PROPERTY FLYBALL_DOMAINS "")

# flyball_precompile(<target>)
#
# The headers that nearly every source includes. A precompiled header serves targets that compile
# with the same flags: the first target of each kind makes it. Text kind: sources that read, write
# and print; they are compiled for size of build, since no robot waits for them.
function(flyball_precompile target)
  get_target_property(is_text ${target} FLYBALL_TEXT)
  if(is_text)
    set(kind TEXT)
    set(header ${PROJECT_SOURCE_DIR}/src/io/precompiled.hpp)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  else()
    set(kind NUMERIC)
    set(header ${PROJECT_SOURCE_DIR}/src/core/precompiled.hpp)
  endif()
  if(BUILD_SHARED_LIBS)
    return()
  endif()
  get_property(maker GLOBAL PROPERTY FLYBALL_PRECOMPILED_${kind})
  if(maker)
    target_precompile_headers(${target} REUSE_FROM ${maker})
  else()
    target_precompile_headers(${target} PRIVATE ${header})
    set_property(GLOBAL PROPERTY FLYBALL_PRECOMPILED_${kind} ${target})
  endif()
endfunction()

# flyball_batch(<target>)
#
# Where FLYBALL_UNITY_BUILD is on, what several sources of a unit share is compiled once: a whole build
# takes half the time, one source a little more. Names in unnamed namespaces are hence those of the
# domain. Kernels stay alone: they choose instructions for the rest of their unit.
function(flyball_batch target)
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "kernel|_(baseline|wide)\\.cpp$")
  set_source_files_properties(${sources} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  get_target_property(is_text ${target} FLYBALL_TEXT)
  set(size 5)
  if(is_text)
    set(size 8)
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${FLYBALL_UNITY_BUILD}
                                             UNITY_BUILD_BATCH_SIZE ${size})
endfunction()

# flyball_add_domain(<domain> [TEXT] SOURCES <files...> [DEPENDS <domains...>]
#                    [PRIVATE_HEADERS <targets...>] [PRIVATE_LIBRARIES <targets...>])
#
# One library a domain folder: flyball_<domain>, alias flyball::<domain>. DEPENDS may only name
# domains that the table of docs/architecture.md allows; a test checks the includes. A library with
# compiled code (PRIVATE_LIBRARIES) must be linked by whoever links ours, if it is static:
# flyballConfig.cmake finds it for them. Header-only ones leave no trace in what we install.
function(flyball_add_domain domain)
  cmake_parse_arguments(ARG "TEXT" "" "SOURCES;DEPENDS;PRIVATE_HEADERS;PRIVATE_LIBRARIES" ${ARGN})
  set(target flyball_${domain})
  add_library(${target} ${ARG_SOURCES})
  add_library(flyball::${domain} ALIAS ${target})
  set_target_properties(
    ${target}
    PROPERTIES EXPORT_NAME ${domain}
               VERSION ${PROJECT_VERSION}
               SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
               POSITION_INDEPENDENT_CODE ON)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(
    ${target}
    PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
           $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>
           $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${PROJECT_SOURCE_DIR}/src)
  # Eigen counts as a system header for ourselves and for consumers: its warnings are not theirs.
  target_link_libraries(${target} PUBLIC Eigen3::Eigen tl::expected)
  foreach(dependency IN LISTS ARG_DEPENDS)
    target_link_libraries(${target} PUBLIC flyball::${dependency})
  endforeach()
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:flyball_options>)
  target_link_libraries(${target} PRIVATE ${ARG_PRIVATE_LIBRARIES})
  foreach(library IN LISTS ARG_PRIVATE_HEADERS)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:${library}>)
  endforeach()
  set_target_properties(${target} PROPERTIES FLYBALL_TEXT "${ARG_TEXT}")
  flyball_batch(${target})
  flyball_precompile(${target})
  set_property(GLOBAL APPEND PROPERTY FLYBALL_DOMAINS ${domain})
endfunction()
