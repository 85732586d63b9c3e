# The build information of --version: version, commit, kind of build, compiler. Written at build time into one small
# source, so that a commit compiles no other source again.
if(CMAKE_SCRIPT_MODE_FILE)
  set(commit "no commit known")
  execute_process(COMMAND git rev-parse --short=12 HEAD WORKING_DIRECTORY ${TAKT_SOURCE_DIR}
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(result EQUAL 0)
    set(commit "commit ${output}")
    execute_process(COMMAND git status --porcelain --untracked-files=no WORKING_DIRECTORY ${TAKT_SOURCE_DIR}
      OUTPUT_VARIABLE changes ERROR_QUIET)
    if(changes)
      string(APPEND commit ", changed")
    endif()
  endif()
  set(text "#include <takt_build_info.h>\n\nconst char* takt_build_info() {\n  return \"${TAKT_VERSION} (${commit}; ${TAKT_BUILD})\";\n}\n")
  set(before "")
  if(EXISTS ${TAKT_OUT})
    file(READ ${TAKT_OUT} before)
  endif()
  if(NOT before STREQUAL text)
    file(WRITE ${TAKT_OUT} "${text}")
  endif()
  return()
endif()

set(takt_build_info_dir ${CMAKE_BINARY_DIR}/build_info)
file(WRITE ${takt_build_info_dir}/takt_build_info.h.new
  "#pragma once\n// Made by CMake: version, commit, kind of build, compiler.\nconst char* takt_build_info();\n")
configure_file(${takt_build_info_dir}/takt_build_info.h.new ${takt_build_info_dir}/takt_build_info.h COPYONLY)
add_custom_target(takt_find_build_info BYPRODUCTS ${takt_build_info_dir}/takt_build_info.cpp
  COMMAND ${CMAKE_COMMAND} -DTAKT_SOURCE_DIR=${PROJECT_SOURCE_DIR} -DTAKT_VERSION=${PROJECT_VERSION}
    "-DTAKT_BUILD=${CMAKE_BUILD_TYPE}, ${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}, ${CMAKE_SYSTEM_PROCESSOR}"
    -DTAKT_OUT=${takt_build_info_dir}/takt_build_info.cpp -P ${PROJECT_SOURCE_DIR}/cmake/build_info.cmake
  COMMENT "Build information" VERBATIM)
add_library(takt_build_info STATIC ${takt_build_info_dir}/takt_build_info.cpp)
add_dependencies(takt_build_info takt_find_build_info)
target_include_directories(takt_build_info SYSTEM PUBLIC $<BUILD_INTERFACE:${takt_build_info_dir}>)
