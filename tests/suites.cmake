# SPDX-License-Identifier: Apache-2.0
# Writes FILE, by which ctest runs each suite of the tests of PROGRAM as one test: a process for each single one loads
# LLVM 2500 times, and compiles again what the test before had compiled.
#   cmake -D PROGRAM=... -D FILE=... -D SECONDS=... -P suites.cmake
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listing RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests: ${status}")
endif()
string(REGEX REPLACE "[[;]" "" listing "${listing}") # which lists of CMake take for their own
string(REPLACE "\n" ";" lines "${listing}")
set(text "")
set(suite "")
set(count 0)
function(add)
  if(count GREATER 0)
    string(APPEND text "add_test([=[${suite}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${suite}.*]=])\n"
                       "set_tests_properties([=[${suite}]=] PROPERTIES TIMEOUT ${SECONDS} COST ${count})\n")
    set(text "${text}" PARENT_SCOPE)
  endif()
endfunction()
foreach(line ${lines})
  if(line MATCHES "^([^ ]+)\\.( .*)?$")
    add()
    set(suite "${CMAKE_MATCH_1}")
    set(count 0)
  elseif(line MATCHES "^  " AND NOT line MATCHES "^  DISABLED_")
    math(EXPR count "${count} + 1")
  endif()
endforeach()
add()
file(WRITE ${FILE} "${text}")
