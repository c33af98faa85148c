# SPDX-License-Identifier: Apache-2.0
# What every package of this layer loads: packages written for ROS 2's CMake functions build on Takt.
# Each NAMEConfig.cmake of the prefix includes this file, and then calls takt_ros2_library,
# takt_ros2_messages, takt_ros2_vendor or takt_ros2_tool with its own name.
#
# 1. A real ROS 2 beside the layer is refused: the two define the same names.
# 2. Takt itself is the one that the layer came with: lib/takt/ros2 and lib/cmake/takt lie side by side.
# 3. Imported targets belong to a directory, so they are made at each call; functions only replace
#    themselves.
cmake_policy(PUSH)
cmake_policy(VERSION 3.25)

cmake_path(SET takt_ros2_prefix NORMALIZE "${CMAKE_CURRENT_LIST_DIR}/../../..")
string(REGEX REPLACE "/$" "" takt_ros2_prefix "${takt_ros2_prefix}")

# takt_ros2_is_foreign(variable folder): whether ROS 2's own packages stand in a prefix.
function(takt_ros2_is_foreign variable prefix)
  set(${variable} OFF PARENT_SCOPE)
  file(REAL_PATH "${prefix}" prefix)
  file(REAL_PATH "${takt_ros2_prefix}" ours)
  if(prefix STREQUAL ours)
    return()
  endif()
  foreach(package ament_cmake_core rclcpp)
    if(EXISTS "${prefix}/share/${package}/cmake/${package}Config.cmake")
      set(${variable} ON PARENT_SCOPE)
    endif()
  endforeach()
endfunction()

function(takt_ros2_refuse_another)
  set(advice "Takt's layer for rclcpp stands in ${takt_ros2_prefix}. Name only one of the two in \
CMAKE_PREFIX_PATH, in a fresh build folder, and in a shell in which no setup file of ROS 2 was sourced")
  set(prefixes ${CMAKE_PREFIX_PATH})
  foreach(variable CMAKE_PREFIX_PATH AMENT_PREFIX_PATH)
    string(REPLACE ":" ";" more "$ENV{${variable}}")
    list(APPEND prefixes ${more})
  endforeach()
  foreach(prefix ${prefixes})
    takt_ros2_is_foreign(is_foreign "${prefix}")
    if(is_foreign)
      message(FATAL_ERROR "A ROS 2 stands in the search path too, in ${prefix}: ${advice}.")
    endif()
  endforeach()
  foreach(package ament_cmake_core ament_cmake rosidl_cmake rcl rclcpp)
    if(NOT ${package}_FOUND)
      continue()
    endif()
    cmake_path(IS_PREFIX takt_ros2_prefix "${${package}_DIR}" NORMALIZE is_ours)
    if(NOT is_ours)
      message(FATAL_ERROR "${package} of a ROS 2 has been found before, in ${${package}_DIR}: ${advice}.")
    endif()
  endforeach()
endfunction()
takt_ros2_refuse_another()

# Debian's packages of ROS are ROS 1 or of 2022, and lie where CMake looks last: a package that neither the layer nor
# the workspace has is not to be taken from them.
function(takt_ros2_ignore_those_of_the_system)
  set(prefixes ${CMAKE_SYSTEM_PREFIX_PATH})
  list(REMOVE_ITEM prefixes ${CMAKE_INSTALL_PREFIX} ${CMAKE_PREFIX_PATH})
  set(names "")
  foreach(prefix ${prefixes})
    file(GLOB files ${prefix}/share/*/package.xml)
    foreach(file ${files})
      file(STRINGS ${file} lines REGEX "<(buildtool_depend|build_type)[^>]*>(catkin|ament)" LIMIT_COUNT 1)
      if(lines)
        cmake_path(GET file PARENT_PATH folder)
        cmake_path(GET folder FILENAME name)
        list(APPEND names ${name})
      endif()
    endforeach()
  endforeach()
  foreach(prefix ${prefixes})  # /lib may be a link to /usr/lib
    foreach(name ${names})
      foreach(place share/${name}/cmake lib/cmake/${name} lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/${name})
        cmake_path(APPEND prefix ${place} OUTPUT_VARIABLE folder)
        list(APPEND CMAKE_IGNORE_PATH ${folder})
      endforeach()
    endforeach()
  endforeach()
  set(CMAKE_IGNORE_PATH ${CMAKE_IGNORE_PATH} PARENT_SCOPE)
endfunction()
takt_ros2_ignore_those_of_the_system()

# Setup files of ROS 2 set these, which packages compare; empty, some of their conditions are none.
if(NOT DEFINED ENV{ROS_DISTRO})
  set(ENV{ROS_DISTRO} jazzy)
endif()
if(NOT DEFINED ENV{ROS_VERSION})
  set(ENV{ROS_VERSION} 2)
endif()

# A package of launch files and the like may have no language.
get_property(takt_ros2_languages GLOBAL PROPERTY ENABLED_LANGUAGES)
if("CXX" IN_LIST takt_ros2_languages)
  find_package(takt QUIET REQUIRED CONFIG PATHS ${takt_ros2_prefix}/../../cmake/takt NO_DEFAULT_PATH)
  include(${CMAKE_CURRENT_LIST_DIR}/taktRos2Targets.cmake)
endif()
if(BUILD_TESTING)
  enable_testing()
endif()
include(${CMAKE_CURRENT_LIST_DIR}/ament_package.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/ament_auto.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/ament_tests.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/rosidl.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/components.cmake)

# Says of packages that are often asked for, and are not here, whether they could ever be.
list(APPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_LIST_DIR}/absent)
list(REMOVE_DUPLICATES CMAKE_MODULE_PATH)

# Programs lie in lib/PACKAGE, their libraries in lib: they find each other without a setup file.
if(NOT DEFINED CMAKE_INSTALL_RPATH)
  set(CMAKE_INSTALL_RPATH "$ORIGIN" "$ORIGIN/..")
  set(CMAKE_INSTALL_RPATH_USE_LINK_PATH ON)
endif()

# takt_ros2_target(name library…): an imported target that passes on what it links.
function(takt_ros2_target name)
  if(NOT TARGET ${name})
    add_library(${name} INTERFACE IMPORTED)
    set_target_properties(${name} PROPERTIES INTERFACE_LINK_LIBRARIES "${ARGN}")
  endif()
endfunction()

# takt_ros2_found(package): the variables that packages read.
macro(takt_ros2_found package)
  set(${package}_FOUND ON)
  set(${package}_TARGETS ${package}::${package})
  set(${package}_LIBRARIES ${package}::${package})
  set(${package}_INCLUDE_DIRS "")
  set(${package}_DEFINITIONS "")
endmacro()

# takt_ros2_uses(package…): as in ROS 2, what a package uses is found with it.
macro(takt_ros2_uses)
  foreach(takt_ros2_used ${ARGN})
    if(NOT ${takt_ros2_used}_FOUND)
      find_package(${takt_ros2_used} QUIET REQUIRED)
    endif()
  endforeach()
endmacro()

# takt_ros2_library(package [TARGETS name…] [USES package…] [MAY_USE package…]): its headers are the layer's. The macro
# that registers a component also registers it with class_loader. MAY_USE: what ROS 2's links, if the workspace has it.
macro(takt_ros2_library package)
  cmake_parse_arguments(takt_ros2_library "" "" "TARGETS;USES;MAY_USE" ${ARGN})
  set(takt_ros2_linked takt::takt_rclcpp takt::ros_messages)
  foreach(takt_ros2_name class_loader rclcpp)
    if(takt_ros2_name IN_LIST takt_ros2_library_USES)
      list(APPEND takt_ros2_linked ${takt_ros2_name}::${takt_ros2_name})
    endif()
  endforeach()
  foreach(takt_ros2_name ${package} ${takt_ros2_library_TARGETS})
    takt_ros2_target(${package}::${takt_ros2_name} ${takt_ros2_linked})
  endforeach()
  takt_ros2_found(${package})
  set(takt_ros2_${package}_may_use ${takt_ros2_library_MAY_USE})  # those that are found parse arguments of their own
  takt_ros2_uses(${takt_ros2_library_USES})
  foreach(takt_ros2_name ${takt_ros2_${package}_may_use})
    find_package(${takt_ros2_name} QUIET)
    if(${takt_ros2_name}_FOUND)
      set_property(TARGET ${package}::${package} APPEND PROPERTY INTERFACE_LINK_LIBRARIES ${${takt_ros2_name}_TARGETS})
    endif()
  endforeach()
endmacro()

# takt_ros2_messages(package [USES package…])
macro(takt_ros2_messages package)
  cmake_parse_arguments(takt_ros2_messages "" "" "USES" ${ARGN})
  takt_ros2_target(${package}::${package} takt::${package} takt::ros_messages)
  foreach(takt_ros2_name rosidl_generator_cpp rosidl_typesupport_cpp rosidl_typesupport_introspection_cpp)
    takt_ros2_target(${package}::${package}__${takt_ros2_name} ${package}::${package})
  endforeach()
  takt_ros2_found(${package})
  takt_ros2_uses(${takt_ros2_messages_USES})
endmacro()

# takt_ros2_vendor(package library): the library of this system.
macro(takt_ros2_vendor package library)
  find_package(${library} QUIET)
  set(${package}_FOUND ${${library}_FOUND})
  if(NOT ${package}_FOUND AND ${package}_FIND_REQUIRED)
    message(FATAL_ERROR "${PROJECT_NAME} needs ${package}, and CMake does not find ${library}: install it.")
  endif()
  if(TARGET yaml-cpp)  # before 0.8
    takt_ros2_target(yaml-cpp::yaml-cpp yaml-cpp)
  endif()
  if("${library}" STREQUAL orocos_kdl AND orocos_kdl_FOUND AND NOT TARGET orocos-kdl)  # which has no target on Debian
    takt_ros2_target(orocos-kdl -lorocos-kdl)
    set_target_properties(orocos-kdl PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${orocos_kdl_INCLUDE_DIRS}")
  endif()
endmacro()

# It consists of CMake functions.
macro(takt_ros2_tool package)
  set(${package}_FOUND ON)
  if("${package}" STREQUAL ament_cmake_ros)
    option(BUILD_SHARED_LIBS "add_library() makes shared libraries" ON)
  elseif("${package}" STREQUAL rclpy AND NOT rclpy_FIND_QUIETLY)
    message(NOTICE "${PROJECT_NAME} asks for rclpy: its nodes in Python do not run on Takt")
  endif()
endmacro()

cmake_policy(POP)
