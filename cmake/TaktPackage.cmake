# SPDX-License-Identifier: Apache-2.0
# What is installed, and how other projects find it. No file knows its prefix: it may be moved.

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/takt)

# The command finds the library of its own installation, wherever that lies.
cmake_path(RELATIVE_PATH CMAKE_INSTALL_FULL_LIBDIR BASE_DIRECTORY ${CMAKE_INSTALL_FULL_BINDIR}
           OUTPUT_VARIABLE bin_to_lib)
if(TARGET takt_cli)
  set_target_properties(takt_cli PROPERTIES INSTALL_RPATH "$ORIGIN/${bin_to_lib}")
  install(TARGETS takt_cli)
  foreach(part takt_try_library takt_allocations takt_simulated takt_idl takt_lttng takt_archive)  # so that install works once the command is built
    if(TARGET ${part})
      add_dependencies(takt_cli ${part})
    endif()
  endforeach()
endif()
if(TARGET takt_cli)
  set(completions tools/takt/completions)
  install(FILES ${completions}/takt.bash RENAME takt DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
  install(FILES ${completions}/_takt DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
  install(FILES ${completions}/takt.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
  get_property(takt_has_man_pages GLOBAL PROPERTY takt_has_man_pages)
  if(takt_has_man_pages)
    install(DIRECTORY ${PROJECT_BINARY_DIR}/share/man/man1 DESTINATION ${CMAKE_INSTALL_MANDIR})
  endif()
endif()
get_property(rt_tests GLOBAL PROPERTY takt_rt_tests)
if(rt_tests)
  set_target_properties(${rt_tests} PROPERTIES INSTALL_RPATH "$ORIGIN/${bin_to_lib}")
  install(TARGETS ${rt_tests} OPTIONAL)  # where the command alone was built, that is installed
endif()
install(TARGETS takt EXPORT taktTargets INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(TARGETS takt_try_library RUNTIME DESTINATION ${CMAKE_INSTALL_LIBDIR}/takt)
install(TARGETS takt_idl EXPORT taktTargets LIBRARY DESTINATION ${package_folder})

# A header is public if its namespace is (base/visibility.hpp), or if it has none.
foreach(module ${takt_modules})
  file(GLOB_RECURSE headers RELATIVE ${PROJECT_SOURCE_DIR} CONFIGURE_DEPENDS ${module}/*.hpp)
  foreach(header ${headers})
    file(STRINGS ${header} namespaces REGEX "^namespace ")
    file(STRINGS ${header} public REGEX "^namespace TAKT_PUBLIC ")
    if(namespaces AND NOT public)
      continue()
    endif()
    cmake_path(GET header PARENT_PATH folder)
    if(header STREQUAL containers/takt.hpp)
      set(folder "")
    endif()
    install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/takt/${folder})
  endforeach()
endforeach()

# find_package(takt). Before 1.0 each minor version may break its users.
include(CMakePackageConfigHelpers)
configure_package_config_file(cmake/taktConfig.cmake.in ${PROJECT_BINARY_DIR}/taktConfig.cmake
                              INSTALL_DESTINATION ${package_folder}
                              NO_SET_AND_CHECK_MACRO NO_CHECK_REQUIRED_COMPONENTS_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/taktConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(EXPORT taktTargets NAMESPACE takt:: DESTINATION ${package_folder})
install(FILES ${PROJECT_BINARY_DIR}/taktConfig.cmake ${PROJECT_BINARY_DIR}/taktConfigVersion.cmake
              cmake/TaktComponent.cmake messages/idl/TaktMessages.cmake
        DESTINATION ${package_folder})
install(PROGRAMS messages/idl/takt_messages.py DESTINATION ${package_folder})

# pkg-config.
cmake_path(RELATIVE_PATH CMAKE_INSTALL_PREFIX
           BASE_DIRECTORY ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig OUTPUT_VARIABLE takt_pc_to_prefix)
configure_file(cmake/takt.pc.in ${PROJECT_BINARY_DIR}/takt.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/takt.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

# A package that nobody has used is a guess. A library with sanitizers is for its own tests only.
if(TAKT_BUILD_TESTS AND TARGET takt_cli AND NOT TAKT_SANITIZE)
  foreach(way FindPackage PkgConfig AddSubdirectory)
    add_test(NAME Package.${way} COMMAND ${PROJECT_SOURCE_DIR}/cmake/consumer/test.sh ${way}
                                         ${PROJECT_BINARY_DIR})
    set_tests_properties(
      Package.${way}
      PROPERTIES LABELS package TIMEOUT 900 COST 60
                 ENVIRONMENT "CXX=${CMAKE_CXX_COMPILER};CMAKE_GENERATOR=${CMAKE_GENERATOR};\
CMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER}")
  endforeach()
endif()
