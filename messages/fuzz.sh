#!/usr/bin/env bash
# Compiles cdr_fuzzer.cpp with clang, whatever compiles the rest, and runs it.
#
# usage: fuzz.sh BUILD OPTION_OF_LIBFUZZER...
# SPDX-License-Identifier: Apache-2.0
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "$1" && pwd)
shift
compile=(clang++ -std=c++20 -O1 -g -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all
  -I "$build/include/messages" -I "$build/include/base")

work=$build/fuzz
mkdir -p "$work"
cd "$work"
echo 'extern "C" int LLVMFuzzerTestOneInput(const char*, unsigned long) { return 0; }' >probe.cpp
if ! "${compile[@]}" probe.cpp -o probe 2>probe.log; then
  echo "skipped: no clang++ with libFuzzer (apt-get install clang libclang-rt-dev)"
  exit 77
fi
"${compile[@]}" "$here/cdr_fuzzer.cpp" "$here/cdr.cpp" "$here/message_type.cpp" -o cdr_fuzzer
./cdr_fuzzer -error_exitcode=1 "$@"  # its own code for a finding is 77, which means skipped
