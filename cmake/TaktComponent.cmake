# SPDX-License-Identifier: Apache-2.0
# takt_add_component(demo SOURCES lidar.cpp camera.cpp COMPONENTS demo::Lidar demo::Camera
#                    [LIBRARIES …])
#
# A library of components that containers load by name, with its entry in the component index: in
# the build tree under share/takt/components, and installed beside the library, under the prefix.
# `takt` finds what is installed where itself is; other prefixes, build trees too, are named in the
# environment variable TAKT_COMPONENT_PATH. With TAKT_INSTALL_COMPONENTS OFF nothing is installed.
function(takt_add_component target)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "" "SOURCES;COMPONENTS;LIBRARIES")
  if(NOT ARG_SOURCES OR NOT ARG_COMPONENTS OR ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "takt_add_component(${target} SOURCES file… COMPONENTS class… "
                        "[LIBRARIES target…]) is what it takes")
  endif()
  include(GNUInstallDirs)
  add_library(${target} MODULE ${ARG_SOURCES})
  target_link_libraries(${target} PRIVATE takt::takt ${ARG_LIBRARIES})

  set(index ${CMAKE_INSTALL_DATADIR}/takt/components)
  set(built "")
  set(installed "")
  foreach(component ${ARG_COMPONENTS})
    string(APPEND built "${component};$<TARGET_FILE:${target}>\n")
    string(APPEND installed
           "${component};${CMAKE_INSTALL_LIBDIR}/$<TARGET_FILE_NAME:${target}>\n")
  endforeach()
  file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/share/takt/components/${target} CONTENT "${built}")
  if(DEFINED TAKT_INSTALL_COMPONENTS AND NOT TAKT_INSTALL_COMPONENTS)
    return()
  endif()
  set(entry ${CMAKE_CURRENT_BINARY_DIR}/${target}.index)
  file(GENERATE OUTPUT ${entry} CONTENT "${installed}")
  install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(FILES ${entry} DESTINATION ${index} RENAME ${target})
endfunction()
