# SPDX-License-Identifier: Apache-2.0
# takt_add_messages(robot_msgs msg/Scan.msg srv/Plan.srv drive.idl [PACKAGE name] [LIBRARIES …])
#
# C++ messages from interface files: IDL, and ROS 2's .msg, .srv and .action. robot_msgs is made as an
# INTERFACE library, or may be any target that is there already; targets that link it include
# <robot_msgs/msg/scan.hpp>. The first folder is the package's name, which is the target's own unless
# PACKAGE gives another. LIBRARIES are targets with messages that these files use; those of ROS 2's own
# packages are known without. A shared library that has or links the messages registers their types, for
# `takt topic echo --library` and others that know a type by its name.
function(takt_add_messages target)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "PACKAGE" "LIBRARIES")
  set(call "takt_add_messages(${target} …)")
  if(NOT ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "takt_add_messages(${target} file… [PACKAGE name] [LIBRARIES target…]) is "
                        "what it takes")
  endif()
  if(NOT ARG_PACKAGE)
    set(ARG_PACKAGE ${target})
  endif()
  set(files "")
  foreach(file ${ARG_UNPARSED_ARGUMENTS})
    cmake_path(ABSOLUTE_PATH file BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
    if(NOT EXISTS ${file})
      message(FATAL_ERROR "${call}: there is no file ${file}")
    endif()
    list(APPEND files ${file})
  endforeach()

  if(NOT TARGET ${target})
    add_library(${target} INTERFACE)
  endif()
  get_target_property(type ${target} TYPE)
  if(type STREQUAL INTERFACE_LIBRARY)
    set(scope INTERFACE)
    set(folders "$<TARGET_PROPERTY:${target},INTERFACE_INCLUDE_DIRECTORIES>")
  else()
    set(scope PUBLIC)
    set(folders "$<TARGET_PROPERTY:${target},INCLUDE_DIRECTORIES>")
  endif()
  set(tree ${CMAKE_CURRENT_BINARY_DIR}/takt_messages/${target})
  target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${tree}>)
  target_link_libraries(${target} ${scope} takt::takt ${ARG_LIBRARIES})

  # What other calls have given the target may be used here.
  get_target_property(earlier ${target} TAKT_MESSAGE_STAMPS)
  if(NOT earlier)
    set(earlier "")
  endif()
  string(MD5 hash "${files}")
  string(SUBSTRING ${hash} 0 8 hash)
  set(stamp ${tree}/${hash}.stamp)
  set(registration ${tree}/register_${hash}.cpp)
  set_target_properties(${target} PROPERTIES TAKT_MESSAGE_STAMPS "${earlier};${stamp}")
  takt_generate_messages("${call}" ${ARG_PACKAGE} ${tree} ${stamp} FILES ${files} DEPENDS ${earlier}
    OPTIONS --register ${registration} "$<$<BOOL:${folders}>:-I$<JOIN:${folders},;-I>>"
    BYPRODUCTS ${registration})
  add_custom_target(${target}_messages_${hash} DEPENDS ${stamp})
  add_dependencies(${target} ${target}_messages_${hash})
  if(TARGET takt_idl)  # part of this build, which generates ROS 2's packages first
    add_dependencies(${target}_messages_${hash} takt_ros_messages)
  endif()
  foreach(library ${ARG_LIBRARIES})
    if(TARGET ${library})
      add_dependencies(${target}_messages_${hash} ${library})
    endif()
  endforeach()

  if(type MATCHES "^(SHARED|MODULE)_LIBRARY$")
    target_sources(${target} PRIVATE ${registration})
  elseif(NOT type STREQUAL EXECUTABLE)
    set(user $<TARGET_PROPERTY:TYPE>)
    set(is_loaded $<OR:$<STREQUAL:${user},SHARED_LIBRARY>,$<STREQUAL:${user},MODULE_LIBRARY>>)
    target_sources(${target} INTERFACE $<BUILD_INTERFACE:$<${is_loaded}:${registration}>>)
  endif()
endfunction()

# takt_generate_messages(CALL PACKAGE TREE STAMP FILES file… [OPTIONS argument…] [DEPENDS file…]
#                        [BYPRODUCTS file…])
# Makes the headers of a package in the folder TREE, by one call of the generator, and then the file
# STAMP. Sets `headers` to their paths below TREE. Errors begin with CALL.
function(takt_generate_messages call package tree stamp)
  cmake_parse_arguments(PARSE_ARGV 4 ARG "" "" "FILES;OPTIONS;DEPENDS;BYPRODUCTS")
  find_program(TAKT_IDLC idlc DOC "Cyclone's IDL compiler, for messages")
  find_program(TAKT_PYTHON python3 DOC "Python 3, for messages")
  foreach(need "TAKT_IDLC idlc cyclonedds-tools" "TAKT_PYTHON python3 python3")
    separate_arguments(need)
    list(POP_FRONT need variable program debian)
    if(NOT ${variable})
      message(FATAL_ERROR "${call} needs ${program}, which is not there; on Debian: "
                          "apt-get install ${debian}. Elsewhere it is named by -D ${variable}=…")
    endif()
  endforeach()

  # It runs in idlc, so where the compiler is for another processor, it is that of a build for this one.
  set(TAKT_IDL_PLUGIN "" CACHE FILEPATH "libcycloneddsidltakt.so for this machine, if the compiler is for another")
  set(plugin ${TAKT_IDL_PLUGIN})
  if(NOT plugin)
    set(plugin $<TARGET_FILE:takt::takt_idl>)
  endif()
  set(script ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/takt_messages.py)
  set(command ${TAKT_PYTHON} -I ${script} --package ${package} --tree ${tree})
  execute_process(COMMAND ${command} --print-headers ${ARG_FILES} RESULT_VARIABLE result
                  OUTPUT_VARIABLE headers ERROR_VARIABLE wrong)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${call}:\n${wrong}")
  endif()
  set(headers ${headers} PARENT_SCOPE)
  list(TRANSFORM headers PREPEND ${tree}/)
  add_custom_command(
    OUTPUT ${stamp}
    BYPRODUCTS ${headers} ${ARG_BYPRODUCTS}
    COMMAND ${command} --idlc ${TAKT_IDLC} --plugin ${plugin} ${ARG_OPTIONS} ${ARG_FILES}
    COMMAND ${CMAKE_COMMAND} -E touch ${stamp}
    DEPENDS ${ARG_FILES} ${ARG_DEPENDS} ${script} takt::takt_idl
    COMMENT "Messages of ${package}"
    COMMAND_EXPAND_LISTS VERBATIM)
endfunction()
