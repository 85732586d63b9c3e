# Parts from npm, at build time: `npm install` by a package-lock.json (versions and checksums of all parts) into the build
# tree; not `npm ci`, which refuses a lock that does not list the native parts of other platforms. Where npm is not there or the registry cannot be reached, what needs them is left out with a sentence, and all
# else is built; the next build tries again.
#
# As a script: cmake -DTAKT_NPM_LOCK_DIR=... -DTAKT_NPM_OUT=... -P npm.cmake  installs (what is there already stays).
#   -DTAKT_NPM_RUN=build   and runs that script of package.json, in a copy of the sources
#   -DTAKT_NPM_SOURCES=... generated files beside them
#   -DTAKT_NPM_WHAT=...    what is missing without it, for the sentence
find_program(NPM_PROGRAM npm)
include(${CMAKE_CURRENT_LIST_DIR}/npm_reason.cmake)

function(takt_npm_say sentence)
  message("npm: ${sentence} ${TAKT_NPM_WHAT}")
endfunction()

function(takt_npm_install)
  if(NOT NPM_PROGRAM)
    takt_npm_say("not installed (Debian package npm).")
    return()
  endif()
  file(MAKE_DIRECTORY ${TAKT_NPM_OUT})
  file(SHA256 ${TAKT_NPM_LOCK_DIR}/package-lock.json lock)
  set(stamp ${TAKT_NPM_OUT}/installed.txt)
  set(before "")
  if(EXISTS ${stamp})
    file(READ ${stamp} before)
  endif()
  if(NOT before STREQUAL lock)
    file(COPY ${TAKT_NPM_LOCK_DIR}/package.json ${TAKT_NPM_LOCK_DIR}/package-lock.json DESTINATION ${TAKT_NPM_OUT})
    execute_process(COMMAND ${NPM_PROGRAM} install --ignore-scripts --no-audit --no-fund --fetch-retries 1 --fetch-retry-mintimeout 1000
        --fetch-timeout 30000 --loglevel error
      WORKING_DIRECTORY ${TAKT_NPM_OUT} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output TIMEOUT 300)
    if(NOT result EQUAL 0)
      takt_npm_reason("${output}" reason)
      takt_npm_say("npm install failed (${reason}).")
      return()
    endif()
    file(WRITE ${stamp} ${lock})
  endif()
  if(TAKT_NPM_RUN)
    file(GLOB sources ${TAKT_NPM_LOCK_DIR}/*)
    file(COPY ${sources} ${TAKT_NPM_SOURCES} DESTINATION ${TAKT_NPM_OUT})
    execute_process(COMMAND ${NPM_PROGRAM} run --silent ${TAKT_NPM_RUN}
      WORKING_DIRECTORY ${TAKT_NPM_OUT} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output TIMEOUT 300)
    if(NOT result EQUAL 0)
      message(FATAL_ERROR "npm run ${TAKT_NPM_RUN} failed: ${output}")
    endif()
  endif()
  if(TAKT_NPM_STAMP)
    file(TOUCH ${TAKT_NPM_STAMP})
  endif()
endfunction()

if(CMAKE_SCRIPT_MODE_FILE)
  takt_npm_install()
endif()
