# Compiles SOURCE without WRONG (must succeed) and with it (must fail, and say what the first line
# of the file expects, a regular expression in which "no conversion" stands for a wrong type).
set(compile ${COMPILER} -std=c++20 -fsyntax-only @${FLAGS})

execute_process(COMMAND ${compile} ${SOURCE} RESULT_VARIABLE status ERROR_VARIABLE output)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "The right program does not compile:\n${output}")
endif()

file(STRINGS ${SOURCE} first LIMIT_COUNT 1)
if(NOT first MATCHES "^// error: (.+)$")
  message(FATAL_ERROR "${SOURCE} must begin with \"// error: <regular expression>\"")
endif()
set(expected "${CMAKE_MATCH_1}")
# Every wording of g++ and clang for an argument of the wrong type.
string(
  REPLACE
    "no conversion"
    "no known conversion|could not convert|cannot convert|no viable conversion|no matching function|invalid initialization"
    expected
    "${expected}")

execute_process(
  COMMAND ${CMAKE_COMMAND} -E env LC_ALL=C ${compile} -DWRONG ${SOURCE}
  RESULT_VARIABLE status
  ERROR_VARIABLE output)
if(status EQUAL 0)
  message(FATAL_ERROR "The wrong program compiles.")
endif()
if(NOT output MATCHES "error: [^\n]*(${expected})")
  message(FATAL_ERROR "The wrong program fails, but not with \"${expected}\":\n${output}")
endif()
