# SPDX-License-Identifier: Apache-2.0
# How the parts of Takt are declared. See docs/explanation/architecture.md for which may include which.

# takt_module(NAME executors USES entities sched base [FOLDERS engine] SOURCES a.cpp engine/b.cpp
#             [LIBRARIES yaml-cpp] [TESTED_IN_ONE_THREAD all|FOLDER...])
#
# A folder of the library. Its compiler sees the headers of the modules that it names, as
# <takt/NAME/...>, and of no other, so that includes can only go downwards. Every *_test.cpp in the
# folder, and in those of its folders that it names, belongs to the program NAME_test; every
# *_long_test.cpp, an exhaustive search or many rounds, to NAME_long_test, which has the label `long`.
# TESTED_IN_ONE_THREAD: the tests, or those in these folders, start no other thread, so the thread sanitizer leaves
# them out.
function(takt_module)
  cmake_parse_arguments(ARG "" "NAME" "USES;FOLDERS;SOURCES;LIBRARIES;TESTED_IN_ONE_THREAD" ${ARGN})
  set(folder ${CMAKE_CURRENT_SOURCE_DIR})
  set(link ${PROJECT_BINARY_DIR}/include/${ARG_NAME}/takt/${ARG_NAME})
  file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/include/${ARG_NAME}/takt)
  file(CREATE_LINK ${folder} ${link} SYMBOLIC)

  add_library(takt_${ARG_NAME} OBJECT ${ARG_SOURCES})
  set_target_properties(takt_${ARG_NAME} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  # <takt/base/visibility.hpp> says what is exported. Clang looks for the macro at a function's
  # definition, where it does not stand, so with clang everything is exported.
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    set_target_properties(takt_${ARG_NAME} PROPERTIES C_VISIBILITY_PRESET hidden CXX_VISIBILITY_PRESET hidden
                                                      VISIBILITY_INLINES_HIDDEN ON)
  endif()
  set(modules ${ARG_NAME} ${ARG_USES})
  foreach(module ${modules})
    target_include_directories(takt_${ARG_NAME} PRIVATE ${PROJECT_BINARY_DIR}/include/${module})
  endforeach()
  if("messages" IN_LIST modules)  # those of ROS 2's packages, too
    target_include_directories(takt_${ARG_NAME} PRIVATE ${PROJECT_BINARY_DIR}/include/ros_messages)
    add_dependencies(takt_${ARG_NAME} takt_ros_messages)
  endif()
  target_link_libraries(takt_${ARG_NAME} PRIVATE takt_warnings fmt::fmt ${ARG_LIBRARIES})
  # Which lock guards what. A precise match fails where a lambda names the lock in another way than its caller.
  target_compile_options(takt_${ARG_NAME} PRIVATE
    $<$<COMPILE_LANG_AND_ID:CXX,Clang>:-Wthread-safety;-Werror=thread-safety;-Wno-thread-safety-precise>)
  # What runs at each dispatch: the conformance suite waits for it.
  if(ARG_NAME MATCHES "^(analysis|base|callback_groups|entities|executors|messages|sched)$")
    takt_optimise_under_sanitizers(takt_${ARG_NAME})
  endif()
  target_sources(takt PRIVATE $<TARGET_OBJECTS:takt_${ARG_NAME}>)
  target_link_libraries(takt PRIVATE ${ARG_LIBRARIES})
  target_include_directories(
    takt PUBLIC $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include/${ARG_NAME}>)

  if(TAKT_SANITIZE STREQUAL "thread")
    list(REMOVE_ITEM ARG_FOLDERS ${ARG_TESTED_IN_ONE_THREAD})
  endif()
  list(TRANSFORM ARG_FOLDERS REPLACE ".+" "${folder}/\\0/*_test.cpp")
  file(GLOB tests CONFIGURE_DEPENDS ${folder}/*_test.cpp ${ARG_FOLDERS})
  if(ARG_TESTED_IN_ONE_THREAD STREQUAL "all")
    list(PREPEND tests ONE_THREAD)
  endif()
  takt_tests(${ARG_NAME} ${tests})
endfunction()

# takt_tests(executors [ONE_THREAD] a_test.cpp b_long_test.cpp): executors_test, and executors_long_test.
function(takt_tests name)
  set(tests ${ARGN})
  set(long_tests ${ARGN})
  list(FILTER long_tests INCLUDE REGEX "_long_test[.]cpp$")
  list(FILTER tests EXCLUDE REGEX "_long_test[.]cpp$")
  if(tests MATCHES "_test[.]cpp")
    takt_test(${name}_test ${tests})
  endif()
  if(long_tests AND TAKT_BUILD_TESTS)
    takt_test(${name}_long_test ${long_tests})
    if(TEST ${name}_long_test)
      set_tests_properties(${name}_long_test PROPERTIES LABELS long COST 60)  # begins first
    endif()
  endif()
endfunction()

# takt_man_pages(target): pages for man, of what the program says of itself. Another processor's program
# takes an emulator.
function(takt_man_pages target)
  if(TAKT_SANITIZE OR (CMAKE_CROSSCOMPILING AND NOT CMAKE_CROSSCOMPILING_EMULATOR))
    return()
  endif()
  add_custom_command(
    TARGET ${target} POST_BUILD
    COMMAND ${TAKT_PYTHON} -I ${PROJECT_SOURCE_DIR}/tools/takt/man_pages.py ${PROJECT_BINARY_DIR}/share/man/man1
            ${CMAKE_CROSSCOMPILING_EMULATOR} $<TARGET_FILE:${target}>
    VERBATIM)
  set_property(GLOBAL PROPERTY takt_has_man_pages TRUE)
endfunction()

# takt_optimise_little(target -O1): for what may be slow, so that a release build takes less time or room.
function(takt_optimise_little target level)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:${level}>)
endfunction()

# takt_optimise_under_sanitizers(target): for what runs for so long that it pays, as their presets optimise
# nothing.
function(takt_optimise_under_sanitizers target)
  if(TAKT_SANITIZE)
    target_compile_options(${target} PRIVATE -O1)
  endif()
endfunction()

# takt_sanitized(executors_test RESULT): whether this build runs the test. CI runs each under the sanitizer that sees
# most in it: what threads share, under that of threads, and what owns memory and reads foreign data, under that of
# addresses; random programs under both. With TAKT_SANITIZE_ALL (`./dev sanitize --all`) each runs under both.
function(takt_sanitized name result)
  set(best address)
  if(name MATCHES "^(base|callback_groups|entities|executors|kit|lockfree)(_long)?_test$")
    set(best thread)
  endif()
  if(NOT TAKT_SANITIZE OR TAKT_SANITIZE_ALL OR TAKT_SANITIZE MATCHES ${best} OR name STREQUAL "sequence_test")
    set(${result} TRUE PARENT_SCOPE)
  else()
    set(${result} FALSE PARENT_SCOPE)
  endif()
endfunction()

# takt_test(executors_test [ONE_THREAD] a_test.cpp b_test.cpp): a GoogleTest program. It is one test for
# ctest, as to start a process for each of its cases would take longer than the cases. ONE_THREAD: its tests
# start no other, so the thread sanitizer leaves them out.
function(takt_test name)
  if(NOT TAKT_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "ONE_THREAD" "" "" ${ARGN})
  takt_sanitized(${name} sanitized)
  add_executable(${name} ${ARG_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE takt::takt takt::allocation_counter takt_warnings
                                        takt_testing takt_watchdog GTest::gtest_main GTest::gmock)
  if(name MATCHES "_long_test$")
    takt_optimise_under_sanitizers(${name})
  elseif(NOT name MATCHES "^lockfree_")  # which tests headers, as users compile them
    takt_optimise_little(${name} -O0)
    if(TAKT_SANITIZE)
      target_compile_options(${name} PRIVATE -g0)  # a report names functions
    endif()
  endif()
  if(NOT sanitized OR (ARG_ONE_THREAD AND TAKT_SANITIZE STREQUAL "thread"))
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
    return()
  endif()
  add_test(NAME ${name} COMMAND ${name} --gtest_brief=1)
  takt_limit_test(${name} 900)
endfunction()

# takt_limit_test(executors_test 900): ctest ends it after so many seconds; shortly before it ends by itself,
# and says where it hangs.
function(takt_limit_test name seconds)
  math(EXPR own "${seconds} - 30")
  set_tests_properties(${name} PROPERTIES TIMEOUT ${seconds})
  set_property(TEST ${name} APPEND PROPERTY ENVIRONMENT TAKT_TEST_SECONDS=${own})
endfunction()

# takt_program(name a.cpp): an executable in bin/.
function(takt_program name)
  add_executable(${name} ${ARGN})
  target_link_libraries(${name} PRIVATE takt::takt takt_warnings)
endfunction()
