// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/compression.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

constexpr std::string_view kZstd = "zstd", kLz4 = "lz4";

bool decompress_lz4(std::span<const std::byte> from, std::span<std::byte> to) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) return false;
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      raw, &LZ4F_freeDecompressionContext);
  for (;;) {
    std::size_t read = from.size(), written = to.size();
    const std::size_t hint = LZ4F_decompress(raw, to.data(), &written, from.data(), &read, nullptr);
    if (LZ4F_isError(hint)) return false;
    from = from.subspan(read);
    to = to.subspan(written);
    if (hint == 0) return from.empty() && to.empty();
    if (read == 0 && written == 0) return false;  // it ends too early, or has more
  }
}

}  // namespace

std::span<const std::string> compressions() {
  static const std::array<std::string, 3> names{"none", std::string(kLz4), std::string(kZstd)};
  return names;
}

struct Compressor::Contexts {
  std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> zstd{ZSTD_createCCtx(), &ZSTD_freeCCtx};
};

Compressor::Compressor(const std::string& name, std::size_t most_bytes)
    : name_(name == "none" ? "" : name), most_bytes_(most_bytes) {
  const auto names = compressions();
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    throw Error(fmt::format("there is no compression '{}'", name), suggest(name, names));
  }
  if (name_ == kZstd) {
    contexts_ = std::make_unique<Contexts>();
    compressed_.resize(ZSTD_compressBound(most_bytes));
  } else if (name_ == kLz4) {
    compressed_.resize(LZ4F_compressFrameBound(most_bytes, nullptr));
  }
}

Compressor::~Compressor() = default;

std::span<const std::byte> Compressor::compress(std::span<const std::byte> from) noexcept {
  std::size_t size = 0;
  if (from.size() > most_bytes_) return {};  // a chunk of one long message
  if (name_ == kZstd) {
    size = ZSTD_compressCCtx(contexts_->zstd.get(), compressed_.data(), compressed_.size(),
                             from.data(), from.size(), 1);
    if (ZSTD_isError(size)) size = 0;
  } else if (name_ == kLz4) {
    size = LZ4F_compressFrame(compressed_.data(), compressed_.size(), from.data(), from.size(),
                              nullptr);
    if (LZ4F_isError(size)) size = 0;
  }
  return std::span(compressed_).first(size);
}

bool decompress(std::string_view name, std::span<const std::byte> from, std::span<std::byte> to) {
  if (name == kZstd) {
    return ZSTD_decompress(to.data(), to.size(), from.data(), from.size()) == to.size();
  }
  if (name == kLz4) return decompress_lz4(from, to);
  throw Error(fmt::format("the recording is compressed by '{}'", name),
              fmt::format("Takt reads {} and {}", kLz4, kZstd));
}

std::uint32_t crc32_of(std::span<const std::byte> bytes, std::uint32_t crc) noexcept {
  return static_cast<std::uint32_t>(
      crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace takt
