# SPDX-License-Identifier: Apache-2.0
cmake_minimum_required(VERSION 3.25)
# Writes TO, a header with the commit of SOURCE, where it is not that already.
execute_process(COMMAND git -C ${SOURCE} rev-parse --short=8 HEAD OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE
                ERROR_QUIET RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  set(commit "unknown")
endif()
file(CONFIGURE OUTPUT ${TO} CONTENT "// SPDX-License-Identifier: Apache-2.0\n#pragma once\n#define DPDE_COMMIT \"@commit@\"\n" @ONLY)
