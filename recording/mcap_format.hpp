// Constants of the MCAP format (https://mcap.dev/spec).
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_RECORDING_MCAP_FORMAT_HPP_
#define TAKT_RECORDING_MCAP_FORMAT_HPP_

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace takt::mcap {

inline constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0b,
  kSummaryOffset = 0x0e,
  kDataEnd = 0x0f,
};
inline constexpr std::size_t kRecordHead = 1 + 8;
inline constexpr std::size_t kMessageHead = 2 + 4 + 8 + 8;
// The header of a chunk: times, size, checksum (0: none), name of the compression, size.
inline constexpr std::size_t kChunkHead = 8 + 8 + 8 + 4 + 4 + 8;  // and the name
// In the metadata of a channel, as in recordings of ROS 2.
inline constexpr std::string_view kQosKey = "offered_qos_profiles";
// Of a topic in a chunk, and of each of its messages.
inline constexpr std::size_t kMessageIndexHead = kRecordHead + 2 + 4;
inline constexpr std::size_t kMessageIndexEntry = 8 + 8;

}  // namespace takt::mcap

#endif  // TAKT_RECORDING_MCAP_FORMAT_HPP_
