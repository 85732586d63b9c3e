# Sources are compiled several at a time: what their headers cost is paid once for each batch, which halves the time of a
# build from nothing. A source that is changed often is compiled sooner by itself: -DTAKT_UNITY_BUILD=OFF, as the presets
# for debugging do. Files stay able to stand alone; these presets and ./dev tidy see to that.
option(TAKT_UNITY_BUILD "Compile several sources at a time" ON)

# takt_unity(target N): N sources at a time. CMake leaves out sources with options of their own.
function(takt_unity target batch)
  if(TAKT_UNITY_BUILD)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${batch})
  endif()
endfunction()

# takt_unity_of(target N source...): N of these sources at a time, the target's others each by itself.
function(takt_unity_of target batch)
  if(NOT TAKT_UNITY_BUILD)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  set(count 0)
  foreach(source ${ARGN})
    math(EXPR group "${count} / ${batch}")
    math(EXPR count "${count} + 1")
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP "${target}_${group}")
  endforeach()
endfunction()
