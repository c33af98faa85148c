# SPDX-License-Identifier: Apache-2.0
# ament_package() and what it exports: a package's own PackageConfig.cmake, for those that come after it.
#
# What the ament_export_… functions are given is kept under the project's name in global properties, as
# they may be called from any folder of the project, or from a function.

set(takt_ros2_templates ${CMAKE_CURRENT_LIST_DIR})

function(takt_ros2_keep what)
  set_property(GLOBAL APPEND PROPERTY takt_ros2_${PROJECT_NAME}_${what} ${ARGN})
endfunction()

function(takt_ros2_kept what variable)
  get_property(values GLOBAL PROPERTY takt_ros2_${PROJECT_NAME}_${what})
  list(REMOVE_DUPLICATES values)
  set(${variable} "${values}" PARENT_SCOPE)
endfunction()

# ---- Exports ----

function(ament_export_dependencies)
  takt_ros2_keep(dependencies ${ARGN})
endfunction()

function(ament_export_include_directories)
  takt_ros2_keep(include_directories ${ARGN})
endfunction()

function(ament_export_libraries)
  takt_ros2_keep(libraries ${ARGN})
endfunction()

function(ament_export_definitions)
  takt_ros2_keep(definitions ${ARGN})
endfunction()

function(ament_export_link_flags)
  takt_ros2_keep(link_flags ${ARGN})
endfunction()

# ament_export_targets(export… [NAMESPACE prefix::] [HAS_LIBRARY_TARGET])
function(ament_export_targets)
  cmake_parse_arguments(PARSE_ARGV 0 ARG "HAS_LIBRARY_TARGET" "NAMESPACE" "")
  if(NOT DEFINED ARG_NAMESPACE)
    set(ARG_NAMESPACE ${PROJECT_NAME}::)
  endif()
  foreach(export ${ARG_UNPARSED_ARGUMENTS})
    install(EXPORT ${export} DESTINATION share/${PROJECT_NAME}/cmake NAMESPACE "${ARG_NAMESPACE}"
            FILE ${export}Export.cmake)
    takt_ros2_keep(targets ${export})
  endforeach()
endfunction()

function(ament_export_interfaces)
  ament_export_targets(${ARGN})
endfunction()

# ---- Dependencies of a target ----

# ament_target_dependencies(target [SYSTEM] [INTERFACE|PUBLIC|PRIVATE] package…)
function(ament_target_dependencies target)
  if(NOT TARGET ${target})
    message(FATAL_ERROR "ament_target_dependencies(${target} …): there is no target of that name")
  endif()
  cmake_parse_arguments(PARSE_ARGV 1 ARG "SYSTEM;INTERFACE;PUBLIC;PRIVATE" "" "")
  set(scope "")  # the signature that most packages use for the same target
  set(include_scope PUBLIC)
  foreach(one INTERFACE PUBLIC PRIVATE)
    if(ARG_${one})
      set(scope ${one})
      set(include_scope ${one})
    endif()
  endforeach()
  set(system "")
  if(ARG_SYSTEM)
    set(system SYSTEM)
  endif()
  foreach(package ${ARG_UNPARSED_ARGUMENTS})
    if(NOT ${package}_FOUND AND NOT ${package}_TARGETS)
      message(FATAL_ERROR "ament_target_dependencies(${target} …): ${package} has not been found before; "
                          "call find_package(${package} REQUIRED)")
    endif()
    if(${package}_TARGETS)
      target_link_libraries(${target} ${scope} ${${package}_TARGETS})
    else()
      target_include_directories(${target} ${system} ${include_scope} ${${package}_INCLUDE_DIRS})
      target_compile_definitions(${target} ${include_scope} ${${package}_DEFINITIONS})
      target_link_libraries(${target} ${scope} ${${package}_LIBRARIES})
    endif()
  endforeach()
endfunction()

# The older function for folders of headers: later ones stand before those that they overlay.
function(ament_include_directories_order variable)
  set(${variable} ${ARGN} PARENT_SCOPE)
endfunction()

# ---- package.xml ----

# ament_package_xml([DIRECTORY folder]): NAME_VERSION, NAME_BUILD_DEPENDS and the like.
macro(ament_package_xml)
  takt_ros2_read_package_xml(${ARGN})
  foreach(takt_ros2_name VERSION ${takt_ros2_dependency_kinds})
    set(${PROJECT_NAME}_${takt_ros2_name} "${takt_ros2_xml_${takt_ros2_name}}")
  endforeach()
endmacro()

set(takt_ros2_dependency_kinds BUILD_DEPENDS BUILDTOOL_DEPENDS BUILD_EXPORT_DEPENDS BUILDTOOL_EXPORT_DEPENDS
                               EXEC_DEPENDS TEST_DEPENDS)

function(takt_ros2_read_package_xml)
  cmake_parse_arguments(PARSE_ARGV 0 ARG "" "DIRECTORY" "")
  if(NOT ARG_DIRECTORY)
    set(ARG_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
  endif()
  set(file ${ARG_DIRECTORY}/package.xml)
  if(NOT EXISTS ${file})
    message(FATAL_ERROR "${PROJECT_NAME} has no ${file}; a package of ROS 2 has one")
  endif()
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(READ ${file} text)
  if(text MATCHES "condition=")
    execute_process(COMMAND python3 -I ${takt_ros2_prefix}/share/takt_ros2/cmake/build.py --applying ${file}
                    OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  endif()
  string(REGEX REPLACE "<!--([^-]|-[^-])*-->" "" text "${text}")
  string(REGEX MATCH "<version[^>]*>[ \n]*([^< \n]*)" ignored "${text}")
  set(takt_ros2_xml_VERSION "${CMAKE_MATCH_1}" PARENT_SCOPE)
  foreach(kind ${takt_ros2_dependency_kinds})
    string(REGEX REPLACE "S$" "" element "${kind}")
    string(TOLOWER ${element} element)
    if(kind MATCHES "^(BUILD|BUILD_EXPORT|EXEC)_DEPENDS$")  # <depend> is all three
      set(element "(${element}|depend)")
    endif()
    set(names "")
    string(REGEX MATCHALL "<${element}( [^>]*)?>[^<]*<" found "${text}")
    foreach(one ${found})
      if(one MATCHES ">[ \n]*([^< \n]+)[ \n]*<$")
        list(APPEND names ${CMAKE_MATCH_1})
      endif()
    endforeach()
    list(REMOVE_DUPLICATES names)
    set(takt_ros2_xml_${kind} "${names}" PARENT_SCOPE)
  endforeach()
endfunction()

# ament_generate_version_header(target [HEADER_PATH path] [INSTALL_PATH path] [SKIP_INSTALL]): NAME/version.h
function(ament_generate_version_header target)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "SKIP_INSTALL" "HEADER_PATH;INSTALL_PATH" "")
  if(NOT ARG_HEADER_PATH)
    set(ARG_HEADER_PATH ${PROJECT_NAME}/version.h)
  endif()
  if(NOT ARG_INSTALL_PATH)
    set(ARG_INSTALL_PATH include/${PROJECT_NAME})
  endif()
  takt_ros2_read_package_xml()
  if(NOT takt_ros2_xml_VERSION MATCHES "^([0-9]+)[.]([0-9]+)[.]([0-9]+)$")
    message(FATAL_ERROR "ament_generate_version_header(${target}): package.xml of ${PROJECT_NAME} has the version "
                        "'${takt_ros2_xml_VERSION}', which is not of the form 1.2.3")
  endif()
  string(TOUPPER ${PROJECT_NAME} name)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/ament_generate_version_header/${target})
  file(CONFIGURE OUTPUT ${folder}/${ARG_HEADER_PATH} CONTENT
"// Made by Takt: the version of the package ${PROJECT_NAME}.
#pragma once
#define ${name}_VERSION_MAJOR (${CMAKE_MATCH_1})
#define ${name}_VERSION_MINOR (${CMAKE_MATCH_2})
#define ${name}_VERSION_PATCH (${CMAKE_MATCH_3})
#define ${name}_VERSION_STR \"${takt_ros2_xml_VERSION}\"
#define ${name}_VERSION_GTE(major, minor, patch) \\
  (${CMAKE_MATCH_1} > (major) || (${CMAKE_MATCH_1} == (major) && \\
   (${CMAKE_MATCH_2} > (minor) || (${CMAKE_MATCH_2} == (minor) && ${CMAKE_MATCH_3} >= (patch)))))
")
  get_target_property(type ${target} TYPE)
  set(scope PUBLIC)
  if(type STREQUAL "INTERFACE_LIBRARY")
    set(scope INTERFACE)
  endif()
  target_include_directories(${target} ${scope} "$<BUILD_INTERFACE:${folder}>" "$<INSTALL_INTERFACE:${ARG_INSTALL_PATH}>")
  if(NOT ARG_SKIP_INSTALL)
    install(DIRECTORY ${folder}/ DESTINATION ${ARG_INSTALL_PATH})
  endif()
endfunction()

# ---- The index of resources ----

# ament_index_register_resource(type [CONTENT text|CONTENT_FILE file] [PACKAGE_NAME name] [SKIP_INSTALL])
function(ament_index_register_resource type)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "SKIP_INSTALL" "CONTENT;CONTENT_FILE;PACKAGE_NAME" "")
  if(NOT ARG_PACKAGE_NAME)
    set(ARG_PACKAGE_NAME ${PROJECT_NAME})
  endif()
  if(ARG_CONTENT_FILE)
    file(READ ${ARG_CONTENT_FILE} ARG_CONTENT)
  endif()
  set(place share/ament_index/resource_index/${type})
  file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/${place}/${ARG_PACKAGE_NAME} CONTENT "${ARG_CONTENT}")
  if(NOT ARG_SKIP_INSTALL)
    install(FILES ${CMAKE_BINARY_DIR}/${place}/${ARG_PACKAGE_NAME} DESTINATION ${place})
  endif()
endfunction()

function(takt_ros2_prefixes variable)
  string(REPLACE ":" ";" more "$ENV{AMENT_PREFIX_PATH}")
  set(${variable} ${CMAKE_PREFIX_PATH} ${more} PARENT_SCOPE)
endfunction()

function(ament_index_get_resource variable type package)
  takt_ros2_prefixes(prefixes)
  foreach(prefix ${prefixes})
    set(file ${prefix}/share/ament_index/resource_index/${type}/${package})
    if(EXISTS ${file})
      file(READ ${file} text)
      set(${variable} "${text}" PARENT_SCOPE)
      return()
    endif()
  endforeach()
  message(FATAL_ERROR "ament_index_get_resource: ${package} has no resource ${type} in ${prefixes}")
endfunction()

function(ament_index_has_resource variable type package)
  takt_ros2_prefixes(prefixes)
  set(${variable} OFF PARENT_SCOPE)
  foreach(prefix ${prefixes})
    if(EXISTS ${prefix}/share/ament_index/resource_index/${type}/${package})
      set(${variable} ${prefix} PARENT_SCOPE)
      return()
    endif()
  endforeach()
endfunction()

function(ament_index_get_resources variable type)
  takt_ros2_prefixes(prefixes)
  set(names "")
  foreach(prefix ${prefixes})
    file(GLOB found RELATIVE ${prefix}/share/ament_index/resource_index/${type}
         ${prefix}/share/ament_index/resource_index/${type}/*)
    list(APPEND names ${found})
  endforeach()
  list(REMOVE_DUPLICATES names)
  set(${variable} "${names}" PARENT_SCOPE)
endfunction()

# ---- Extensions ----

# ament_register_extension(point package file): what packages that are found want to be included at a point of those
# that find them, as pluginlib does at the end of a package; ament_execute_extensions(point) includes them.
macro(ament_register_extension point package file)
  list(APPEND takt_ros2_extensions_${point} "${${package}_DIR}/${file}")
  list(REMOVE_DUPLICATES takt_ros2_extensions_${point})
endmacro()

macro(ament_execute_extensions point)
  foreach(takt_ros2_extension ${takt_ros2_extensions_${point}})
    include(${takt_ros2_extension})
  endforeach()
endmacro()

# ---- The end of a package ----

# Environment hooks are for shells; programs of this layer need none.
function(ament_environment_hooks)
endfunction()

# ament_package([CONFIG_EXTRAS file…] [CONFIG_EXTRAS_POST file…])
macro(ament_package)
  ament_execute_extensions(ament_package)
  takt_ros2_read_package_xml()
  takt_ros2_end_package(${ARGN})
endmacro()

function(takt_ros2_end_package)
  cmake_parse_arguments(PARSE_ARGV 0 ARG "" "" "CONFIG_EXTRAS;CONFIG_EXTRAS_POST")
  if(ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "ament_package: '${ARG_UNPARSED_ARGUMENTS}' is unknown; it takes CONFIG_EXTRAS and "
                        "CONFIG_EXTRAS_POST")
  endif()
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/ament_cmake_core)
  set(place share/${PROJECT_NAME}/cmake)
  foreach(what dependencies include_directories libraries definitions link_flags targets messages)
    takt_ros2_kept(${what} ${what})
  endforeach()
  foreach(kind CONFIG_EXTRAS CONFIG_EXTRAS_POST)
    set(extras_${kind} "")
    foreach(file ${ARG_${kind}})
      cmake_path(ABSOLUTE_PATH file BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
      cmake_path(GET file FILENAME name)
      if(name MATCHES "[.]in$")
        string(REGEX REPLACE "[.]in$" "" name ${name})
        configure_file(${file} ${folder}/${name} @ONLY)
        set(file ${folder}/${name})
      endif()
      install(FILES ${file} DESTINATION ${place})
      list(APPEND extras_${kind} ${name})
    endforeach()
  endforeach()
  takt_ros2_exported_libraries(libraries ${libraries})
  configure_file(${takt_ros2_templates}/PackageConfig.cmake.in ${folder}/${PROJECT_NAME}Config.cmake @ONLY)
  include(CMakePackageConfigHelpers)
  write_basic_package_version_file(${folder}/${PROJECT_NAME}Config-version.cmake VERSION
                                   "${takt_ros2_xml_VERSION}" COMPATIBILITY AnyNewerVersion)
  install(FILES ${folder}/${PROJECT_NAME}Config.cmake ${folder}/${PROJECT_NAME}Config-version.cmake
          DESTINATION ${place})
  install(FILES package.xml DESTINATION share/${PROJECT_NAME})
  ament_index_register_resource(packages CONTENT "")
  get_property(components GLOBAL PROPERTY takt_ros2_${PROJECT_NAME}_components)
  if(components)
    ament_index_register_resource(rclcpp_components CONTENT "${components}")
  endif()
endfunction()

# Those that are files: of targets of this project, by the name of the file.
function(takt_ros2_exported_libraries variable)
  set(names "")
  foreach(library ${ARGN})
    if(NOT TARGET ${library})
      list(APPEND names ${library})
      continue()
    endif()
    get_target_property(type ${library} TYPE)
    get_target_property(name ${library} OUTPUT_NAME)
    if(type MATCHES "^(SHARED|STATIC)_LIBRARY$")
      if(NOT name)
        set(name ${library})
      endif()
      list(APPEND names ${name})
    endif()
  endforeach()
  set(${variable} "${names}" PARENT_SCOPE)
endfunction()
