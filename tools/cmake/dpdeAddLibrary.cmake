# SPDX-License-Identifier: Apache-2.0
# dpde_add_library(NAME FILE.dpde [SCENE|TASK name] [SCHEME name] [MARCH cpu] [SET key=value ...] [DEPENDS files ...])
# Runs `dpde build` whenever FILE, a file it imports or one of DEPENDS has changed. Link NAME and include "NAME.h".

# Files that `file` imports, and those that they import, so that a change in one builds anew.
function(dpde_imports_of file result)
  set(found "")
  set(open "${file}")
  while(open)
    list(POP_FRONT open next)
    if(NOT EXISTS "${next}" OR "${next}" IN_LIST found)
      continue()
    endif()
    list(APPEND found "${next}")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${next}")
    cmake_path(GET next PARENT_PATH folder)
    file(STRINGS "${next}" lines REGEX "^[ \t]*import[ \t]+\"[^\"]+\"")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "^[ \t]*import[ \t]+\"([^\"]+)\".*" "\\1" path "${line}")
      cmake_path(ABSOLUTE_PATH path BASE_DIRECTORY "${folder}" NORMALIZE)
      list(APPEND open "${path}")
    endforeach()
  endwhile()
  set(${result} "${found}" PARENT_SCOPE)
endfunction()

function(dpde_add_library name file)
  cmake_parse_arguments(PARSE_ARGV 2 ARG "" "SCENE;TASK;SCHEME;MARCH" "SET;DEPENDS")
  if(ARG_UNPARSED_ARGUMENTS OR (ARG_SCENE AND ARG_TASK))
    message(FATAL_ERROR "dpde_add_library(${name}): give one of SCENE and TASK; not understood: ${ARG_UNPARSED_ARGUMENTS}")
  endif()
  cmake_path(ABSOLUTE_PATH file BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/${name}.dpde")
  file(MAKE_DIRECTORY "${folder}")
  dpde_imports_of("${file}" files)
  set(options "")
  if(ARG_SCHEME)
    list(APPEND options --scheme "${ARG_SCHEME}")
  endif()
  if(ARG_MARCH)
    list(APPEND options --march "${ARG_MARCH}")
  endif()
  foreach(setting IN LISTS ARG_SET)
    list(APPEND options --set "${setting}")
  endforeach()
  add_custom_command(
    OUTPUT "${folder}/${name}.h" "${folder}/${name}.cpp" "${folder}/lib${name}.so"
    COMMAND "${CMAKE_COMMAND}" -E env "CXX=${CMAKE_CXX_COMPILER}" "$<TARGET_FILE:dpde::command>" build "${file}" ${ARG_SCENE} ${ARG_TASK}
            -o "${folder}" --name ${name} ${options} --quiet
    DEPENDS "${file}" ${files} ${ARG_DEPENDS} "$<TARGET_FILE:dpde::command>"
    COMMENT "dpde build ${name}"
    VERBATIM)
  add_custom_target(${name}_dpde DEPENDS "${folder}/${name}.h" "${folder}/lib${name}.so")
  add_library(${name} SHARED IMPORTED GLOBAL)
  set_target_properties(${name} PROPERTIES IMPORTED_LOCATION "${folder}/lib${name}.so" IMPORTED_SONAME "lib${name}.so")
  target_include_directories(${name} INTERFACE "${folder}")
  target_link_libraries(${name} INTERFACE dpde::runtime)
  add_dependencies(${name} ${name}_dpde)
endfunction()
