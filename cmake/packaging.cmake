# cmake --install BUILD --prefix DIR, and a Debian package: cpack -G DEB in the build tree.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(takt_programs)
install(TARGETS takt_cell LIBRARY DESTINATION lib/takt)
install(TARGETS takt-fmu-host RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
foreach(program takt takt-server takt-run takt-controller takt-ur takt-rsi takt-egm takt-modbus takt-from-cad)
  if(TARGET ${program})
    list(APPEND takt_programs ${program})
  endif()
endforeach()
install(TARGETS ${takt_programs} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/config/scenarios ${PROJECT_SOURCE_DIR}/config/devices ${PROJECT_SOURCE_DIR}/config/robots
  ${PROJECT_SOURCE_DIR}/config/meshes ${PROJECT_SOURCE_DIR}/config/programs ${PROJECT_SOURCE_DIR}/config/dds
  ${PROJECT_SOURCE_DIR}/config/dashboards ${PROJECT_SOURCE_DIR}/config/gateways ${PROJECT_SOURCE_DIR}/config/cad
  ${PROJECT_SOURCE_DIR}/config/plc ${PROJECT_SOURCE_DIR}/config/ros ${PROJECT_SOURCE_DIR}/config/verification
  DESTINATION ${CMAKE_INSTALL_DATADIR}/takt/config PATTERN generator EXCLUDE)
install(FILES README.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} PATTERN figures EXCLUDE PATTERN site EXCLUDE)
install(FILES "config/systemd/takt-server@.service" DESTINATION lib/systemd/system)
install(DIRECTORY ${CMAKE_BINARY_DIR}/idl/generated/ros/takt_msgs DESTINATION ${CMAKE_INSTALL_DATADIR}/takt/ros)
install(DIRECTORY idl/ DESTINATION ${CMAKE_INSTALL_DATADIR}/takt/idl FILES_MATCHING PATTERN "*.idl" PATTERN common EXCLUDE
  PATTERN transport EXCLUDE)
# Optional parts are installed if they were built.
install(DIRECTORY ${CMAKE_BINARY_DIR}/share/takt/view DESTINATION ${CMAKE_INSTALL_DATADIR}/takt OPTIONAL)
if(TARGET takt_opcua)
  install(PROGRAMS client_lib/opcua/takt-opcua DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(DIRECTORY ${CMAKE_BINARY_DIR}/share/takt/opcua DESTINATION ${CMAKE_INSTALL_DATADIR}/takt OPTIONAL)
endif()
install(FILES ${CMAKE_BINARY_DIR}/vhacd/package/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME VHACD-LICENSE OPTIONAL)

# Manual pages and the shell's words, from the help texts of the programs.
find_program(HELP2MAN help2man)
if(HELP2MAN)
  set(manuals)
  foreach(program ${takt_programs})
    set(page ${CMAKE_BINARY_DIR}/share/man/man1/${program}.1)
    string(REPLACE "takt-server" "simulated robotic cell as a service over DDS" what ${program})
    string(REPLACE "takt-run" "simulate a scenario headless in one process" what "${what}")
    string(REPLACE "takt-controller" "emulated robot controller" what "${what}")
    string(REPLACE "takt-ur" "protocols of Universal Robots for a robot of a cell" what "${what}")
    string(REPLACE "takt-rsi" "KUKA RSI for a robot of a cell" what "${what}")
    string(REPLACE "takt-egm" "ABB EGM for a robot of a cell" what "${what}")
    string(REPLACE "takt-modbus" "Modbus TCP between a PLC and a cell" what "${what}")
    string(REPLACE "takt-from-cad" "make a cell from a STEP or GLB file" what "${what}")
    if(what STREQUAL "takt")
      set(what "look at a running cell, control and record it")
    endif()
    add_custom_command(OUTPUT ${page}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/share/man/man1
      COMMAND ${HELP2MAN} --no-info --no-discard-stderr --section 1 --name ${what} --output ${page} $<TARGET_FILE:${program}>
      DEPENDS ${program} COMMENT "Manual page of ${program}" VERBATIM)
    list(APPEND manuals ${page})
  endforeach()
  add_custom_target(takt_manuals ALL DEPENDS ${manuals})
  install(FILES ${manuals} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
else()
  message(STATUS "Manual pages: not made (help2man is needed)")
endif()
if(TARGET takt)
  # Each shell looks for a file of the program's name; one file serves all of them.
  set(completions)
  function(takt_completion shell file folder)
    set(words ${CMAKE_BINARY_DIR}/share/completions/${shell}/${file})
    add_custom_command(OUTPUT ${words}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/share/completions/${shell}
      COMMAND sh -c "$<TARGET_FILE:takt> completion ${shell} > ${words}"
      DEPENDS takt COMMENT "Completion for ${shell}" VERBATIM)
    set(completions ${completions} ${words} PARENT_SCOPE)
    if(shell STREQUAL "zsh")
      install(FILES ${words} DESTINATION ${CMAKE_INSTALL_DATADIR}/${folder})
    else()
      foreach(program ${takt_programs})
        string(REPLACE takt ${program} name ${file})
        install(FILES ${words} DESTINATION ${CMAKE_INSTALL_DATADIR}/${folder} RENAME ${name})
      endforeach()
    endif()
  endfunction()
  takt_completion(bash takt bash-completion/completions)
  takt_completion(zsh _takt zsh/vendor-completions)
  takt_completion(fish takt.fish fish/vendor_completions.d)
  add_custom_target(takt_completion ALL DEPENDS ${completions})
endif()

# For one's own clients: find_package(takt), link takt::takt_client, #include <takt/client.h>.
if(TARGET takt_client)
  include(${PROJECT_SOURCE_DIR}/cmake/fast_dds.cmake)
  install(DIRECTORY client_lib/include/takt DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(FILES client_lib/client.h client_lib/cell.h client_lib/lockstep_controller.h
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/takt/client_lib)
  foreach(header takt_enumerations ros2_msgs takt_msgs takt_topics takt_requests takt_request_table)
    install(FILES ${TAKT_GENERATED_DIR}/${header}.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/takt)
  endforeach()
  install(FILES idl/common/eigen_messages.h idl/common/enumeration.h idl/common/message.h
    idl/common/named_lists.h idl/common/topic.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/takt/idl/common)
  install(FILES idl/vocabulary/arguments.h idl/vocabulary/request.h
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/takt/idl/vocabulary)
  install(FILES client_lib/kinematics/arm.h client_lib/kinematics/motions.h client_lib/kinematics/motion_profile.h
    client_lib/kinematics/trajectory_point.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/takt/client_lib/kinematics)
  install(FILES plant_models/spatial.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/takt/plant_models)
  install(FILES plant_models/robot/arm_kinematics.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/takt/plant_models/robot)
  install(TARGETS takt_client takt_kinematics plant_models takt_vocabulary takt_common takt_idl takt_transport takt_rtps_guard takt_recording takt_warnings EXPORT takt
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} ${CMAKE_INSTALL_INCLUDEDIR}/takt)
  install(EXPORT takt NAMESPACE takt:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/takt FILE taktTargets.cmake)
  file(WRITE ${CMAKE_BINARY_DIR}/taktConfig.cmake
    "include(CMakeFindDependencyMacro)\nfind_dependency(${TAKT_FAST_DDS_PACKAGE})\nfind_dependency(Threads)\nfind_dependency(ZLIB)\nfind_dependency(nlohmann_json)\nfind_dependency(Eigen3)\ninclude(\${CMAKE_CURRENT_LIST_DIR}/taktTargets.cmake)\n")
  write_basic_package_version_file(${CMAKE_BINARY_DIR}/taktConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${CMAKE_BINARY_DIR}/taktConfig.cmake ${CMAKE_BINARY_DIR}/taktConfigVersion.cmake
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/takt)
endif()
if(TARGET takt_python)
  install(TARGETS takt_python DESTINATION lib/python3/dist-packages/takt)
  install(FILES ${TAKT_PYTHON_FILES} DESTINATION lib/python3/dist-packages/takt)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME takt)
set(CPACK_PACKAGE_VENDOR "takt")
set(CPACK_PACKAGE_CONTACT "takt <takt@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Simulation of robotic assembly for virtual commissioning")
set(CPACK_PACKAGE_DESCRIPTION
  "A service that simulates robotic assembly and disassembly.\nRobot controllers send it commands over DDS as to a real cell; it answers\nwith where every part is, what holds it, and which forces act. With tools,\na viewer, client development files, a Python module, and a systemd unit.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS python3)
if(TARGET takt_python)  # the module is for one version of the interpreter
  execute_process(COMMAND ${TAKT_PYTHON_EXECUTABLE} -c
      "import sys; v = sys.version_info; print(f'python3 (>= {v[0]}.{v[1]}), python3 (<< {v[0]}.{v[1] + 1}), python3-numpy', end='')"
    OUTPUT_VARIABLE CPACK_DEBIAN_PACKAGE_DEPENDS)
endif()
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/prerm)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS gnuplot-nox)
if(TARGET takt_client)
  set(CPACK_DEBIAN_PACKAGE_SUGGESTS "nodejs (>= 18), lib${TAKT_FAST_DDS_PACKAGE}-dev, libeigen3-dev, nlohmann-json3-dev, libzstd-dev, liblz4-dev, zlib1g-dev")
endif()
include(CPack)
