# SPDX-License-Identifier: Apache-2.0
# Versions of the library's symbols: TAKT_PRIVATE for what packaging/symbols/private lists, so that a program
# that was linked with it says so (readelf -V), and TAKT_<major>.<minor> for all else. Which names are exported
# at all is said by <takt/base/visibility.hpp>.
set(version_script ${PROJECT_BINARY_DIR}/takt.map)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/packaging/symbols/private)
file(STRINGS ${PROJECT_SOURCE_DIR}/packaging/symbols/private names REGEX "^takt")
set(patterns "")
foreach(name ${names})
  string(REGEX REPLACE " *#.*" "" name "${name}")
  # The linker compares with demangled names. What is in quotes is looked up, and patterns are tried one after the other.
  string(APPEND patterns "    \"${name}\";\n    ${name}[!a-zA-Z0-9_]*;\n    \"typeinfo for ${name}\";\n"
         "    \"typeinfo name for ${name}\";\n    \"vtable for ${name}\";\n    non-virtual?thunk?to?${name}::*;\n    [tv][yt]*?for?${name}::*;\n")
endforeach()
file(CONFIGURE OUTPUT ${version_script} @ONLY CONTENT
     "TAKT_PRIVATE {\n  extern \"C++\" {\n@patterns@  };\n};\nTAKT_@PROJECT_VERSION_MAJOR@.@PROJECT_VERSION_MINOR@ {\n  global: *;\n};\n")
target_link_options(takt PRIVATE -Wl,--version-script=${version_script})
set_target_properties(takt PROPERTIES LINK_DEPENDS ${version_script})
