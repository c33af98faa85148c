# SPDX-License-Identifier: Apache-2.0
# Debian's cross compiler for arm64, for the preset of this name: see docs/how_to/cross_compile_for_a_board.md.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
find_program(TAKT_QEMU qemu-aarch64)
if(TAKT_QEMU)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${TAKT_QEMU})
endif()
