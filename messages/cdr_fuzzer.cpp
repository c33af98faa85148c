// Fuzz target for the decoder. The decoder must refuse the bytes, or decode a message that stays
// the same after encoding and decoding, and its memory use must be bounded by the number of bytes.
// The sanitizers report every access beyond the bytes. See fuzz.sh.
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <cstdlib>
#include <memory>

#include <sanitizer/allocator_interface.h>

#include "takt/messages/message_type.hpp"

namespace {

struct Nothing {};
TAKT_MESSAGE(Nothing, "fuzz_msgs/msg/Nothing");
struct Part {
  std::string name;
  std::array<float, 3> position{};
  std::vector<std::byte> data;
  Nothing nothing;
};
TAKT_MESSAGE(Part, "fuzz_msgs/msg/Part", name, position, data, nothing);
struct Everything {
  bool flag = false;
  char letter = 0;
  std::int8_t small = 0;
  std::uint16_t number = 0;
  std::int32_t sum = 0;
  std::uint64_t large = 0;
  float ratio = 0;
  double value = 0;
  std::byte octet{};
  std::string text;
  Part part;
  std::array<bool, 3> flags{};
  std::array<std::string, 2> names;
  std::array<Part, 2> pair;
  std::vector<bool> bits;
  std::vector<double> values;
  std::vector<std::string> texts;
  std::vector<Part> parts;
  std::vector<Nothing> nothings;
  std::vector<std::array<std::int16_t, 5>> rows;
  std::vector<std::vector<std::uint32_t>> lists;
};
TAKT_MESSAGE(Everything, "fuzz_msgs/msg/Everything", flag, letter, small, number, sum, large, ratio,
             value, octet, text, part, flags, names, pair, bits, values, texts, parts, nothings,
             rows, lists);

// An element in memory is at most 8 times as large as its smallest encoding (std::string: 32 and 4
// bytes). It can allocate nested elements before the decoder finds that bytes are missing: so
// twice.
constexpr std::size_t kMemoryPerByte = 16;

// Allocated by the decoding thread: libFuzzer has a second thread, which checks the memory in use.
thread_local std::size_t allocated = 0;

void demand(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "cdr_fuzzer: %s\n", what);
  std::abort();
}

bool decode(std::span<const std::byte> bytes, Everything& message) {
  return takt::message_type<Everything>().decode(bytes, &message);
}

takt::ByteBuffer encode(const Everything& message) {
  takt::ByteBuffer bytes;
  takt::message_type<Everything>().encode(&message, bytes);
  return bytes;
}

// Bytes, as a number that is none is not equal to itself.
bool is_same(const takt::ByteBuffer& one, const takt::ByteBuffer& other) {
  return std::equal(one.bytes().begin(), one.bytes().end(), other.bytes().begin(),
                    other.bytes().end());
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  takt::message_type<Everything>();  // is made here, and not counted
  __sanitizer_install_malloc_and_free_hooks(
      [](const volatile void*, std::size_t size) { allocated += size; },
      [](const volatile void*) {});
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> bytes(reinterpret_cast<const std::byte*>(data), size);
  Everything message;
  allocated = 0;
  const bool is_message = decode(bytes, message);
  demand(allocated <= kMemoryPerByte * size, "more memory than the message could hold");
  if (!is_message) return 0;

  const takt::ByteBuffer sent = encode(message);
  Everything received;
  demand(decode(sent.bytes(), received), "the decoder refuses an encoded message");
  demand(is_same(encode(received), sent), "a decoded message differs from the encoded one");
  // Decode into another message, because receivers reuse messages.
  message = {.flag = true,
             .text = "old",
             .names = {"old", "older"},
             .bits = {true, false, true},
             .texts = {"old"},
             .parts = {{.name = "old"}, {.name = "older"}},
             .lists = {{1, 2}, {3}}};
  demand(decode(sent.bytes(), message), "the decoder refuses the bytes for a reused message");
  demand(is_same(encode(message), sent), "a reused message keeps old content");
  return 0;
}
