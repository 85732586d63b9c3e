# V-HACD 4 (BSD-3), one header: convex decomposition of meshes. Debian has no package of it, so it comes from the npm
# package vhacd-js, pinned by version and checksum, into the build tree; nothing of it is committed. Without it takt
# builds all the same and refuses only scenarios that ask for `method: vhacd`.
#   -DTAKT_VHACD_INCLUDE_DIR=DIR   a VHACD.h one has already
#   -DTAKT_WITH_VHACD=OFF          do not look for it
# Sets TAKT_VHACD_FOUND and TAKT_VHACD_INCLUDE_DIR.
include(${CMAKE_CURRENT_LIST_DIR}/npm_reason.cmake)
option(TAKT_WITH_VHACD "Build with V-HACD, fetched by npm pack if no TAKT_VHACD_INCLUDE_DIR is given" ON)
set(TAKT_VHACD_INCLUDE_DIR "" CACHE PATH "Directory of VHACD.h (version 4); empty: fetched")
set(takt_vhacd_package vhacd-js-0.0.1)
set(takt_vhacd_sha512
  51f15bc56925e7d9a3b4c5f5cf90215b11aef7545d1caebb24e1f27e021403f824f970f7d1d8c6e97260129558eb95f85bf6b4e14f6ead642794b8ec5b096028)

function(takt_fetch_vhacd directory)
  set(archive ${directory}/${takt_vhacd_package}.tgz)
  file(MAKE_DIRECTORY ${directory})
  if(NOT EXISTS ${archive})
    find_program(NPM_PROGRAM npm)
    if(NOT NPM_PROGRAM)
      message(WARNING "V-HACD is not there: npm is not installed (Debian package npm). Scenarios with "
        "`method: vhacd` will be refused.")
      return()
    endif()
    message(STATUS "Fetching V-HACD: npm pack vhacd-js@0.0.1")
    execute_process(
      COMMAND ${NPM_PROGRAM} pack vhacd-js@0.0.1 --cache ${directory}/npm_cache --fetch-retries 1 --fetch-retry-mintimeout 1000 --fetch-timeout 30000 --loglevel error
      WORKING_DIRECTORY ${directory} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output TIMEOUT 120)
    file(REMOVE_RECURSE ${directory}/npm_cache)
    if(NOT result EQUAL 0 OR NOT EXISTS ${archive})
      takt_npm_reason("${output}" reason)
      message(WARNING "V-HACD is not there: npm pack vhacd-js@0.0.1 failed (${reason}). Scenarios with "
        "`method: vhacd` will be refused; configuring again tries again.")
      return()
    endif()
  endif()
  file(SHA512 ${archive} found)
  if(NOT found STREQUAL takt_vhacd_sha512)
    file(REMOVE ${archive})
    message(FATAL_ERROR "${archive} is not what takt was written for: SHA512 is ${found}, it should be "
      "${takt_vhacd_sha512}. It was removed.")
  endif()
  file(ARCHIVE_EXTRACT INPUT ${archive} DESTINATION ${directory} PATTERNS package/include/VHACD.h package/LICENSE)
endfunction()

set(TAKT_VHACD_FOUND FALSE)
if(TAKT_WITH_VHACD)
  if(NOT TAKT_VHACD_INCLUDE_DIR)
    set(takt_vhacd_directory ${CMAKE_BINARY_DIR}/vhacd)
    if(NOT EXISTS ${takt_vhacd_directory}/package/include/VHACD.h)
      takt_fetch_vhacd(${takt_vhacd_directory})
    endif()
    set(TAKT_VHACD_INCLUDE_DIR ${takt_vhacd_directory}/package/include)  # this run only; the cache entry stays empty
  endif()
  if(EXISTS ${TAKT_VHACD_INCLUDE_DIR}/VHACD.h)
    set(TAKT_VHACD_FOUND TRUE)
  endif()
endif()
