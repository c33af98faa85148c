# SPDX-License-Identifier: Apache-2.0
# takt::conformance: the suite that every executor must pass, for a program that links it and the
# executors to be tested. It consists of sources, because GoogleTest is that of the program: whose
# project finds it, before it adds Takt if that is a subfolder.
# Takt's own executors are tested with the same files, by executors_test.
add_library(takt_conformance INTERFACE)
add_library(takt::conformance ALIAS takt_conformance)
set_target_properties(takt_conformance PROPERTIES EXPORT_NAME conformance)
target_link_libraries(takt_conformance INTERFACE takt::takt GTest::gtest_main GTest::gmock)

set(suite ${CMAKE_INSTALL_DATADIR}/takt/conformance)
file(GLOB sources CONFIGURE_DEPENDS executors/conformance/*_test.cpp)
# Without it, tests that count allocations would be skipped.
list(APPEND sources ${PROJECT_SOURCE_DIR}/base/allocation_counter.cpp)
foreach(source ${sources})
  cmake_path(GET source FILENAME name)
  target_sources(takt_conformance INTERFACE $<BUILD_INTERFACE:${source}>
                                            $<INSTALL_INTERFACE:${suite}/${name}>)
endforeach()
target_include_directories(
  takt_conformance INTERFACE $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include/testing>
                             $<INSTALL_INTERFACE:${suite}/include>)
if(TAKT_INSTALL)
  install(TARGETS takt_conformance EXPORT taktTargets)
  install(FILES ${sources} DESTINATION ${suite})
  install(FILES executors/conformance/conformance.hpp
          DESTINATION ${suite}/include/takt/executors/conformance)
  install(FILES testing/eventually.hpp testing/outside.hpp testing/pipe.hpp
          DESTINATION ${suite}/include/takt/testing)
endif()
