# Headers of libraries that most files of a target read are parsed once for each target. Headers of ours are not among
# them: a change would rebuild everything. Files include what they use all the same; the asan preset, which has no
# precompiled headers, and ./dev tidy see to that.
option(TAKT_PRECOMPILED_HEADERS "Parse headers of libraries once for each target" ON)
set(TAKT_STANDARD_HEADERS <algorithm> <array> <cmath> <cstdint> <filesystem> <fstream> <functional> <limits> <map>
  <memory> <optional> <random> <sstream> <stdexcept> <string> <utility> <vector>)
set(TAKT_EIGEN_HEADERS <Eigen/Core> <Eigen/Geometry>)
set(TAKT_JSON_HEADERS <nlohmann/json.hpp>)
set(TAKT_CLI_HEADERS <CLI/CLI.hpp>)
set(TAKT_DDS_HEADERS <fastdds/dds/domain/DomainParticipant.hpp> <fastdds/dds/publisher/DataWriter.hpp>
  <fastdds/dds/subscriber/DataReader.hpp> <fastdds/dds/subscriber/DataReaderListener.hpp>)
set(TAKT_TEST_HEADERS <gtest/gtest.h> <gmock/gmock.h>)

# takt_precompile(target [LIKE other] KIND...): STANDARD always; EIGEN, JSON, CLI, DDS, TEST where named. LIKE: another
# target of the same kinds and compile options has parsed them.
function(takt_precompile target)
  if(NOT TAKT_PRECOMPILED_HEADERS)
    return()
  endif()
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "LIKE" "")
  if(arg_LIKE)
    target_precompile_headers(${target} REUSE_FROM ${arg_LIKE})
  else()
    set(headers ${TAKT_STANDARD_HEADERS})
    foreach(kind ${arg_UNPARSED_ARGUMENTS})
      list(APPEND headers ${TAKT_${kind}_HEADERS})
    endforeach()
    target_precompile_headers(${target} PRIVATE ${headers})
  endif()
  # gcc (12 and 14) takes what it inlines from precompiled headers for ours and warns of std::string's own copies.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow
      -Wno-stringop-overread)
  endif()
endfunction()
