# The habits of every target, in one place.

# Interface target with the project's warnings and sanitizers; private to our own targets, never
# exported, and never an -march flag: Eigen's layout depends on it.
add_library(flyball_options INTERFACE)
target_compile_features(flyball_options INTERFACE cxx_std_20)
target_compile_options(flyball_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # False positives on std::string in g++ 12: https://gcc.gnu.org/bugzilla/show_bug.cgi?id=105651
  target_compile_options(flyball_options INTERFACE -Wno-restrict -Wno-stringop-overflow
                                                   -Wno-array-bounds)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  # The standard library of g++ 12 deprecates what its own std::stable_sort is made of.
  target_compile_options(flyball_options INTERFACE -Wno-deprecated-declarations)
endif()
if(FLYBALL_WARNINGS_AS_ERRORS)
  target_compile_options(flyball_options INTERFACE -Werror)
endif()
if(FLYBALL_SANITIZER)
  target_compile_options(flyball_options INTERFACE -fsanitize=${FLYBALL_SANITIZER}
                                                   -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(flyball_options INTERFACE -fsanitize=${FLYBALL_SANITIZER})
endif()

set_property(GLOBAL PROPERTY FLYBALL_DOMAINS "")

# flyball_add_domain(<domain> SOURCES <files...> [DEPENDS <domains...>] [PRIVATE_LIBRARIES <...>])
#
# One library a domain folder: flyball_<domain>, alias flyball::<domain>. DEPENDS may only name
# domains that the table of docs/architecture.md allows; a test checks the includes.
function(flyball_add_domain domain)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS;PRIVATE_LIBRARIES" ${ARGN})
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
  # Every domain formats; with the same flags everywhere one precompiled header serves them all.
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:fmt::fmt-header-only>)
  if(NOT BUILD_SHARED_LIBS)
    if(domain STREQUAL core)
      target_precompile_headers(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src/core/precompiled.hpp)
    else()
      target_precompile_headers(${target} REUSE_FROM flyball_core)
    endif()
  endif()
  foreach(library IN LISTS ARG_PRIVATE_LIBRARIES)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:${library}>)
  endforeach()
  set_property(GLOBAL APPEND PROPERTY FLYBALL_DOMAINS ${domain})
endfunction()
