# Fast DDS 2 (Debian 12) or 3 (Debian 13). Sets TAKT_FAST_DDS_MAJOR, TAKT_FAST_DDS_PACKAGE (of CMake; in Debian it is
# libNAME-dev) and TAKT_FAST_DDS_LIBRARIES. The differences in the code are in idl/transport/fastdds/fastdds.h.
find_package(fastdds 3 QUIET)
if(fastdds_FOUND)
  set(TAKT_FAST_DDS_MAJOR 3)
  set(TAKT_FAST_DDS_PACKAGE fastdds)
else()
  find_package(fastrtps 2.9 QUIET)
  if(NOT fastrtps_FOUND)
    message(FATAL_ERROR "Fast DDS is not there: neither version 3 (Debian 13: libfastdds-dev) nor 2.9 (Debian 12: "
      "libfastrtps-dev). ./dev build installs it; -DTAKT_WITH_DDS=OFF builds takt-run alone.")
  endif()
  set(TAKT_FAST_DDS_MAJOR 2)
  set(TAKT_FAST_DDS_PACKAGE fastrtps)
endif()
set(TAKT_FAST_DDS_LIBRARIES ${TAKT_FAST_DDS_PACKAGE})
