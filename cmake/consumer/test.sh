#!/usr/bin/env bash
# Uses a build of Takt as another project would: test.sh FindPackage|PkgConfig|AddSubdirectory BUILD
# `test.sh AddSubdirectory BUILD whole` compiles the whole library again, for some minutes (./dev stress).
# SPDX-License-Identifier: Apache-2.0
set -euo pipefail
way=$1 build=$2
consumer=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

install_takt() {  # and moves it, as nothing in it may remember where it was installed
  cmake --install "$build" --prefix "$work/installed" >/dev/null
  mv "$work/installed" "$work/moved"
  "$work/moved/bin/takt" list executors >/dev/null
}
run() {  # run FOLDER: the programs end by themselves when a message has come
  "$1/hello"
  "$1/component" "$consumer/system.yaml"
}
run_messages() {  # run_messages FOLDER: what takt_add_messages made, which CMake alone has
  if command -v idlc >/dev/null; then "$1/messages"; fi
}
none() {  # none COMMAND: it must print nothing
  local found
  found=$("$@") || true
  [ -z "$found" ] || { echo "there should be no $found" >&2; exit 1; }
}

case $way in
  FindPackage)
    # Clang's programs can use it, too, whatever compiled it, and clang takes half of GCC's time for the suite.
    if command -v clang++ >/dev/null; then export CXX=clang++; fi
    install_takt
    cmake -S "$consumer" -B "$work/build" -D CMAKE_PREFIX_PATH="$work/moved"
    grep "^takt_DIR:PATH=$work/moved/" "$work/build/CMakeCache.txt"  # and no other installation
    cmake --build "$work/build"
    run "$work/build"
    ctest --test-dir "$work/build" --output-on-failure --no-tests=error
    run_messages "$work/build"
    # An executor of ours, in a file with its own keys: 2 ms of each 10 ms, so a fifth of the time.
    cp "$consumer/polling_server.yaml" "$work"
    "$work/moved/bin/takt" run "$work/polling_server.yaml" --duration 1s --json - | "$consumer/polling_server.py"
    # What `takt new` writes builds, and its test passes.
    if command -v idlc >/dev/null; then
      (cd "$work" && moved/bin/takt new my_robot)
      cmake -S "$work/my_robot" -B "$work/my_robot/build" -D CMAKE_PREFIX_PATH="$work/moved"
      cmake --build "$work/my_robot/build"
      ctest --test-dir "$work/my_robot/build" --output-on-failure --no-tests=error
    fi
    # A package of rclcpp, from the prefix inside of the installation.
    if command -v idlc >/dev/null; then
      cmake -S "$consumer/../../rclcpp/testdata/packages/sky_interfaces" -B "$work/sky" \
        -D CMAKE_PREFIX_PATH="$("$work/moved/bin/takt" ros2 prefix)"
      cmake --build "$work/sky"
      "$work/sky/print_sky"
    fi
    ;;
  PkgConfig)
    install_takt
    PKG_CONFIG_PATH=$(dirname "$(find "$work/moved" -name takt.pc)")
    export PKG_CONFIG_PATH
    read -ra flags <<<"$(pkg-config --cflags takt)"
    read -ra libraries <<<"$(pkg-config --libs takt)"
    for program in hello component; do
      "$CXX" -std=c++20 -Wall -Wextra -Werror "${flags[@]}" "$consumer/$program.cpp" -o "$work/$program" "${libraries[@]}"
    done
    run "$work"
    # A scheduler, as docs/how_to/write_a_scheduler.md builds it.
    example=$consumer/../../examples/06_scheduler
    "$CXX" -std=c++20 -O2 -shared -fPIC "$example/fair_share.cpp" -o "$work/libfair_share.so" \
      "${flags[@]}" "${libraries[@]}"
    cp "$example/robot.yaml" "$work"
    "$work/moved/bin/takt" check "$work/robot.yaml"
    # The headers warn nobody who compiles with warnings: the user's flags hold for them, as -I is no
    # -isystem. No installed header needs the headers of what only the library uses.
    (cd "$work/moved/include" && find takt -name '*.hpp' -printf '#include "%p"\n') >"$work/all.cpp"
    "$CXX" -std=c++20 -Wall -Wextra -Wpedantic -Wshadow -Werror "${flags[@]}" -fsyntax-only -MD -MF "$work/all.d" "$work/all.cpp"
    grep -v '/include/takt/' "$work/all.d" >"$work/others.d"
    none grep -E '/(dds|iceoryx[^/]*|yaml-cpp|nlohmann|boost|CLI|gtest)/|/liburing' "$work/others.d"
    ;;
  AddSubdirectory)
    # Unoptimised and several files as one, as other projects may; later only what has changed since.
    cmake -S "$consumer" -B "$build/consumer" -D TAKT_SOURCE="$consumer/../.." \
      -D CMAKE_BUILD_TYPE=Debug -D CMAKE_CXX_FLAGS_DEBUG= -D CMAKE_UNITY_BUILD=ON -D CMAKE_UNITY_BUILD_BATCH_SIZE=0 \
      -D BUILD_TESTING=ON
    # Only the library: no tests, benchmarks, examples or tools, though the parent has tests.
    none grep -oP '^build takt/\S+: CXX_EXECUTABLE_LINKER__(?!takt_try_library)\w+' "$build/consumer/build.ninja"
    if [ "${3:-}" != whole ]; then  # what is made for these and their headers, and no library
      cmake --build "$build/consumer" --target CMakeFiles/{hello,component}.dir/Unity/unity_0_cxx.cxx.o
      exit
    fi
    # Without the conformance suite, which FindPackage compiles.
    cmake --build "$build/consumer" --target hello component $(command -v idlc >/dev/null && echo messages)
    run "$build/consumer"
    run_messages "$build/consumer"
    ;;
esac
