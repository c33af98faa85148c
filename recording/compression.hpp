// Compression and checksums of chunks.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_RECORDING_COMPRESSION_HPP_
#define TAKT_RECORDING_COMPRESSION_HPP_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// The names of compressions in MCAP files, but that of none is empty there: "none", "lz4", "zstd".
std::span<const std::string> compressions();

/// Compresses chunks of a bounded size.
/// Thread safety: one thread at a time.
/// Real-time: no; a call takes time in proportion to its input.
class Compressor {
 public:
  /// `name`: one of compressions(); throws Error for another.
  Compressor(const std::string& name, std::size_t most_bytes);
  ~Compressor();
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;

  /// As MCAP files have it: "" for none.
  const std::string& name() const noexcept { return name_; }
  /// Valid until the next call; empty if there is no compression, it has failed, or the input is
  /// longer than expected.
  std::span<const std::byte> compress(std::span<const std::byte> from) noexcept;

 private:
  struct Contexts;
  std::string name_;
  const std::size_t most_bytes_;
  std::unique_ptr<Contexts> contexts_;
  std::vector<std::byte> compressed_;
};

/// Decompresses exactly as many bytes as `to` has room for; returns false if the input has others.
/// Throws Error if `name` is no compression of MCAP files.
bool decompress(std::string_view name, std::span<const std::byte> from, std::span<std::byte> to);

/// CRC-32 as in zlib and MCAP; `crc` is that of the bytes before, 0 at first.
std::uint32_t crc32_of(std::span<const std::byte> bytes, std::uint32_t crc = 0) noexcept;

}  // namespace takt

#endif  // TAKT_RECORDING_COMPRESSION_HPP_
