# SPDX-License-Identifier: Apache-2.0
# Tests of packages. With -D BUILD_TESTING=ON those of GoogleTest are built; checks of style, and tests that
# need ROS 2's Python, do nothing.

foreach(takt_ros2_name
        ament_lint_auto_find_test_dependencies ament_clang_format ament_clang_tidy ament_copyright ament_cppcheck
        ament_cpplint ament_flake8 ament_lint_cmake ament_mypy ament_pep257 ament_pycodestyle ament_pyflakes
        ament_uncrustify ament_xmllint ament_pclint
        ament_add_pytest_test ament_add_nose_test ament_add_test ament_add_test_label ament_add_google_benchmark_test
        add_launch_test add_ros_test ament_add_ros_isolated_launch_test
        call_for_each_rmw_implementation ament_python_install_package ament_python_install_module)
  cmake_language(EVAL CODE "function(${takt_ros2_name})\nendfunction()")
endforeach()

# A target that is not built, as packages link libraries to it.
function(ament_add_google_benchmark target)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "SKIP_LINKING_MAIN_LIBRARIES;SKIP_TEST" "RUNNER;TIMEOUT;WORKING_DIRECTORY"
                        "ENV;APPEND_ENV;APPEND_LIBRARY_DIRS")
  add_executable(${target} EXCLUDE_FROM_ALL ${ARG_UNPARSED_ARGUMENTS})
endfunction()

# ament_find_gtest(), ament_find_gmock()
macro(ament_find_gtest)
  if(NOT TARGET GTest::gtest_main)
    find_package(GTest QUIET)
  endif()
endmacro()

macro(ament_find_gmock)
  ament_find_gtest()
endmacro()

# takt_ros2_add_tests(library target file… [SKIP_LINKING_MAIN_LIBRARIES]): as properties, because the package
# itself links more, in whichever of CMake's two ways.
function(takt_ros2_add_test_program library target)
  cmake_parse_arguments(PARSE_ARGV 2 ARG "SKIP_LINKING_MAIN_LIBRARIES;SKIP_TEST" "RUNNER;TIMEOUT;WORKING_DIRECTORY"
                        "ENV;APPEND_ENV;APPEND_LIBRARY_DIRS")
  ament_find_gtest()
  if(NOT TARGET GTest::gtest_main)
    message(STATUS "The test ${target} is left out, as there is no GoogleTest (on Debian: libgmock-dev)")
    return()
  endif()
  add_executable(${target} ${ARG_UNPARSED_ARGUMENTS})
  set(libraries ${library})
  if(NOT ARG_SKIP_LINKING_MAIN_LIBRARIES)
    list(PREPEND libraries GTest::gtest_main)
  endif()
  set_property(TARGET ${target} APPEND PROPERTY LINK_LIBRARIES ${libraries})
endfunction()

function(takt_ros2_run_test target)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "SKIP_TEST" "RUNNER;TIMEOUT;WORKING_DIRECTORY;TEST_NAME"
                        "ENV;APPEND_ENV;APPEND_LIBRARY_DIRS")
  if(NOT TARGET ${target} OR ARG_SKIP_TEST)
    return()
  endif()
  foreach(otherwise TIMEOUT:60 TEST_NAME:${target} WORKING_DIRECTORY:${CMAKE_CURRENT_BINARY_DIR})
    string(REGEX MATCH "^([A-Z_]+):(.*)$" ignored "${otherwise}")
    if(NOT ARG_${CMAKE_MATCH_1})
      set(ARG_${CMAKE_MATCH_1} ${CMAKE_MATCH_2})
    endif()
  endforeach()
  add_test(NAME ${ARG_TEST_NAME} COMMAND ${target} WORKING_DIRECTORY ${ARG_WORKING_DIRECTORY})
  # What a setup file of the workspace would set.
  set(more "")
  foreach(prefix ${CMAKE_PREFIX_PATH})
    list(APPEND more "AMENT_PREFIX_PATH=path_list_append:${prefix}")
  endforeach()
  foreach(folder ${ARG_APPEND_LIBRARY_DIRS})
    list(APPEND more "LD_LIBRARY_PATH=path_list_prepend:${folder}")
  endforeach()
  set_tests_properties(${ARG_TEST_NAME} PROPERTIES TIMEOUT ${ARG_TIMEOUT} ENVIRONMENT "${ARG_ENV};${ARG_APPEND_ENV}"
                                                   ENVIRONMENT_MODIFICATION "${more}")
endfunction()

function(ament_add_gtest_executable target)
  takt_ros2_add_test_program(GTest::gtest ${target} ${ARGN})
endfunction()

function(ament_add_gmock_executable target)
  takt_ros2_add_test_program(GTest::gmock ${target} ${ARGN})
endfunction()

foreach(takt_ros2_name gtest gmock)
  cmake_language(EVAL CODE "
    function(ament_add_${takt_ros2_name}_test target)
      takt_ros2_run_test(\${target} \${ARGN})
    endfunction()
    function(ament_add_${takt_ros2_name} target)
      takt_ros2_add_test_program(GTest::${takt_ros2_name} \${target} \${ARGN})
      takt_ros2_run_test(\${target} \${ARGN})
    endfunction()
    function(ament_add_ros_isolated_${takt_ros2_name} target)
      ament_add_${takt_ros2_name}(\${target} \${ARGN})
    endfunction()")
endforeach()
