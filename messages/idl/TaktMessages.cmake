# SPDX-License-Identifier: Apache-2.0
# takt_add_messages(robot_msgs msg/Scan.msg srv/Plan.srv drive.idl [PACKAGE name] [LIBRARIES …])
#
# C++ messages from interface files: IDL, and ROS 2's .msg, .srv and .action. robot_msgs is made as an
# INTERFACE library, or may be any target that is there already; targets that link it include
# <robot_msgs/msg/scan.hpp>. The first folder is the package's name, which is the target's own unless
# PACKAGE gives another. LIBRARIES are targets with messages that these files use; those of ROS 2's own
# packages are known without.
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
  find_program(TAKT_IDLC idlc DOC "Cyclone's IDL compiler, for takt_add_messages")
  find_program(TAKT_PYTHON python3 DOC "Python 3, for takt_add_messages")
  foreach(need "TAKT_IDLC idlc cyclonedds-tools" "TAKT_PYTHON python3 python3")
    separate_arguments(need)
    list(POP_FRONT need variable program package)
    if(NOT ${variable})
      message(FATAL_ERROR "${call} needs ${program}, which is not there; on Debian: "
                          "apt-get install ${package}. Elsewhere it is named by -D ${variable}=…")
    endif()
  endforeach()

  set(files "")
  foreach(file ${ARG_UNPARSED_ARGUMENTS})
    cmake_path(ABSOLUTE_PATH file BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
    if(NOT EXISTS ${file})
      message(FATAL_ERROR "${call}: there is no file ${file}")
    endif()
    list(APPEND files ${file})
  endforeach()
  set(tree ${CMAKE_CURRENT_BINARY_DIR}/takt_messages/${target})
  set(script ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/takt_messages.py)
  set(command ${TAKT_PYTHON} ${script} --package ${ARG_PACKAGE} --tree ${tree})
  execute_process(COMMAND ${command} --print-headers ${files} RESULT_VARIABLE result
                  OUTPUT_VARIABLE headers ERROR_VARIABLE wrong)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${call}:\n${wrong}")
  endif()
  list(TRANSFORM headers PREPEND ${tree}/)

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
  target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${tree}>)
  target_link_libraries(${target} ${scope} takt::takt ${ARG_LIBRARIES})

  # What other calls have given the target may be used here.
  get_target_property(earlier ${target} TAKT_MESSAGE_HEADERS)
  if(NOT earlier)
    set(earlier "")
  endif()
  set_target_properties(${target} PROPERTIES TAKT_MESSAGE_HEADERS "${earlier};${headers}")
  add_custom_command(
    OUTPUT ${headers}
    COMMAND ${command} --idlc ${TAKT_IDLC} --plugin $<TARGET_FILE:takt::takt_idl>
            "$<$<BOOL:${folders}>:-I$<JOIN:${folders},;-I>>" ${files}
    DEPENDS ${files} ${earlier} ${script} takt::takt_idl
    COMMENT "Messages of ${target}"
    COMMAND_EXPAND_LISTS VERBATIM)
  string(MD5 hash "${headers}")
  string(SUBSTRING ${hash} 0 8 hash)
  add_custom_target(${target}_messages_${hash} DEPENDS ${headers})
  add_dependencies(${target} ${target}_messages_${hash})
  if(TARGET takt_idl)  # part of this build, which generates ROS 2's packages first
    add_dependencies(${target}_messages_${hash} takt_ros_messages)
  endif()
  foreach(library ${ARG_LIBRARIES})
    if(TARGET ${library})
      add_dependencies(${target}_messages_${hash} ${library})
    endif()
  endforeach()
endfunction()
