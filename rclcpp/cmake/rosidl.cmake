# SPDX-License-Identifier: Apache-2.0
# rosidl_generate_interfaces(): a package's own messages, as takt_add_messages makes them.

# rosidl_generate_interfaces(target file… [DEPENDENCIES package…] [SKIP_INSTALL] …)
macro(rosidl_generate_interfaces target)
  cmake_parse_arguments(takt_ros2_rosidl "ADD_LINTER_TESTS;SKIP_INSTALL;SKIP_GROUP_MEMBERSHIP_CHECK" "LIBRARY_NAME"
                        "DEPENDENCIES" ${ARGN})
  foreach(takt_ros2_name ${takt_ros2_rosidl_DEPENDENCIES})
    if(NOT ${takt_ros2_name}_FOUND)
      find_package(${takt_ros2_name} REQUIRED)
    endif()
  endforeach()
  set(takt_ros2_rosidl_libraries "")
  foreach(takt_ros2_name ${takt_ros2_rosidl_DEPENDENCIES})
    list(APPEND takt_ros2_rosidl_libraries ${${takt_ros2_name}_TARGETS})
  endforeach()
  takt_ros2_generate(${target} "${takt_ros2_rosidl_UNPARSED_ARGUMENTS}" "${takt_ros2_rosidl_DEPENDENCIES}"
                     "${takt_ros2_rosidl_libraries}" ${takt_ros2_rosidl_SKIP_INSTALL})
endmacro()

function(takt_ros2_generate target interfaces dependencies libraries skip_install)
  if(TARGET ${target})
    message(FATAL_ERROR "rosidl_generate_interfaces(${target} …): there is a target ${target} already; give "
                        "it, or the messages, another name")
  endif()
  set(files "")
  foreach(file ${interfaces})
    string(REGEX REPLACE "^(/[^:]*):(.*)$" "\\1/\\2" file "${file}")  # folder:file
    list(APPEND files ${file})
  endforeach()
  set(library ${target}__rosidl_typesupport_cpp)
  takt_add_messages(${library} ${files} PACKAGE ${PROJECT_NAME} LIBRARIES ${libraries})
  target_include_directories(${library} INTERFACE $<INSTALL_INTERFACE:include/${PROJECT_NAME}>)
  foreach(alias ${target}__rosidl_generator_cpp ${target}__rosidl_typesupport_introspection_cpp)
    add_library(${alias} ALIAS ${library})
  endforeach()
  add_custom_target(${target} ALL)
  add_dependencies(${target} ${library})
  if(skip_install)
    return()
  endif()

  set(tree ${CMAKE_CURRENT_BINARY_DIR}/takt_messages/${library})
  install(TARGETS ${library} EXPORT export_${library})
  install(DIRECTORY ${tree}/${PROJECT_NAME} DESTINATION include/${PROJECT_NAME}
          FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h" PATTERN "*.idl")
  install(FILES ${tree}/.takt_messages DESTINATION include/${PROJECT_NAME})
  foreach(file ${files})
    cmake_path(GET file PARENT_PATH folder)
    if(NOT IS_ABSOLUTE ${file})
      install(FILES ${file} DESTINATION share/${PROJECT_NAME}/${folder})
    endif()
  endforeach()
  ament_export_targets(export_${library})
  ament_export_dependencies(${dependencies})
  ament_export_include_directories(include/${PROJECT_NAME})
  takt_ros2_keep(messages ${PROJECT_NAME} ${PROJECT_NAME}__rosidl_generator_cpp)
  ament_index_register_resource(rosidl_interfaces CONTENT "${interfaces}")
endfunction()

# rosidl_get_typesupport_target(variable target rosidl_typesupport_cpp)
function(rosidl_get_typesupport_target variable target type_support)
  if(NOT type_support MATCHES "_cpp$")
    message(FATAL_ERROR "rosidl_get_typesupport_target(${variable} ${target} ${type_support}): Takt's messages "
                        "have one form, that of rosidl_typesupport_cpp; there are none in C or Python")
  endif()
  if(NOT TARGET ${target}__rosidl_typesupport_cpp)
    message(FATAL_ERROR "rosidl_get_typesupport_target(${variable} ${target} ${type_support}): ${target} is no "
                        "target of rosidl_generate_interfaces")
  endif()
  set(${variable} ${target}__rosidl_typesupport_cpp PARENT_SCOPE)
endfunction()

# The older form of the same.
function(rosidl_target_interfaces target interfaces type_support)
  rosidl_get_typesupport_target(library ${interfaces} ${type_support})
  target_link_libraries(${target} ${library})
endfunction()
