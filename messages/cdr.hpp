// Encodes and decodes messages: XCDR1 (plain CDR), little-endian, as in ROS 2.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_CDR_HPP_
#define TAKT_MESSAGES_CDR_HPP_

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/messages/bounded.hpp"

namespace TAKT_PUBLIC takt {

static_assert(std::endian::native == std::endian::little, "the encoding equals the memory layout");

/// Types whose encoding equals their memory layout. The decoder must check a `bool`, which is one
/// byte. An enumeration is encoded as its underlying integer, including values without a name.
template <class T>
concept CdrPrimitive = (std::is_arithmetic_v<T> && sizeof(T) <= 8) || std::is_enum_v<T>;

/// A growing buffer that keeps its memory: once it was large enough, it does not allocate again.
/// Thread safety: none, as for any value.
/// Real-time: allocates only when it grows beyond its largest size so far.
class ByteBuffer {
 public:
  std::span<const std::byte> bytes() const noexcept { return {data_.get(), size_}; }
  std::byte* data() noexcept { return data_.get(); }
  void clear() noexcept { size_ = 0; }
  /// Appends `count` uninitialised bytes, and returns a pointer to them.
  std::byte* extend(std::size_t count) {
    if (size_ + count > capacity_) grow(size_ + count);
    std::byte* begin = data_.get() + size_;
    size_ += count;
    return begin;
  }

 private:
  void grow(std::size_t wanted);

  std::unique_ptr<std::byte[]> data_;
  std::size_t size_ = 0, capacity_ = 0;
};

/// The four bytes before every message, which identify the encoding: plain CDR, little-endian, no
/// options.
inline constexpr std::array<std::byte, 4> kCdrHeader{std::byte{0}, std::byte{1}, std::byte{0},
                                                     std::byte{0}};

/// Appends encoded fields to a buffer. Alignment is relative to the end of the header.
/// Thread safety: none.
/// Real-time: as ByteBuffer.
class CdrWriter {
 public:
  explicit CdrWriter(ByteBuffer& buffer) : buffer_(buffer) {
    std::memcpy(buffer_.extend(kCdrHeader.size()), kCdrHeader.data(), kCdrHeader.size());
    begin_ = buffer_.bytes().size();
  }

  template <CdrPrimitive T>
  void operator()(const T& value) {
    put(&value, sizeof value, sizeof value);
  }
  void operator()(const std::string& text);
  /// ROS 2's wstring: four bytes each, without a zero at the end.
  void operator()(const std::u16string& text);
  template <class T>
  void operator()(const std::vector<T>& values) {
    (*this)(static_cast<std::uint32_t>(values.size()));
    elements(values);
  }
  template <class Container, std::size_t kMost>
  void operator()(const Bounded<Container, kMost>& values) {
    (*this)(values.get());
  }
  template <class T, std::size_t N>
  void operator()(const std::array<T, N>& values) {
    elements(values);
  }
  template <class T>
  void operator()(const T& message) {
    takt_visit_fields(*this, message);
  }
  /// ROS 2 adds this field to a message without fields, because IDL has no empty structures.
  void no_fields() { (*this)(std::uint8_t{0}); }

 private:
  template <class Container>
  void elements(const Container& values) {
    using T = typename Container::value_type;
    if constexpr (CdrPrimitive<T> && !std::same_as<T, bool>) {
      if (!values.empty()) put(values.data(), values.size() * sizeof(T), sizeof(T));
    } else if constexpr (std::same_as<T, bool>) {
      for (const bool value : values) (*this)(value);
    } else {
      for (const T& value : values) (*this)(value);
    }
  }
  void put(const void* data, std::size_t size, std::size_t alignment) {
    const std::size_t offset = buffer_.bytes().size() - begin_;
    const std::size_t padding = (alignment - offset % alignment) % alignment;
    std::byte* to = buffer_.extend(padding + size);
    std::memset(to, 0, padding);
    std::memcpy(to + padding, data, size);
  }

  ByteBuffer& buffer_;
  std::size_t begin_ = 0;
};

/// Computes the smallest encoded size of a type.
/// Thread safety: none.
/// Real-time: no; it allocates.
class CdrLeastSize {
 public:
  template <class T>
  static std::size_t of() {
    CdrLeastSize least;
    least(*std::make_unique<T>());  // may be large
    return std::max<std::size_t>(least.size_, 1);
  }

  template <CdrPrimitive T>
  void operator()(const T&) {
    size_ += sizeof(T);
  }
  void operator()(const std::string&) { size_ += sizeof(std::uint32_t); }
  void operator()(const std::u16string&) { size_ += sizeof(std::uint32_t); }
  template <class T>
  void operator()(const std::vector<T>&) {
    size_ += sizeof(std::uint32_t);
  }
  template <class Container, std::size_t kMost>
  void operator()(const Bounded<Container, kMost>& values) {
    (*this)(values.get());
  }
  template <class T, std::size_t N>
  void operator()(const std::array<T, N>& values) {
    for (const T& value : values) (*this)(value);
  }
  template <class T>
  void operator()(const T& message) {
    takt_visit_fields(*this, message);
  }
  void no_fields() { ++size_; }

 private:
  std::size_t size_ = 0;
};

/// Computed during static initialisation, because real-time threads decode messages.
template <class T>
inline const std::size_t kCdrLeastSize = CdrLeastSize::of<T>();

/// Decodes fields in the order in which they were encoded. The input is untrusted: the reader
/// checks every length against the remaining bytes before it allocates. After the first error, ok()
/// is false and the message's content is unspecified. Thread safety: none. Real-time: allocates
/// only where a string or sequence of the message grows.
class CdrReader {
 public:
  /// `bytes` start with the header, which must be that of little-endian plain CDR.
  explicit CdrReader(std::span<const std::byte> bytes)
      : ok_(bytes.size() >= kCdrHeader.size() && bytes[0] == kCdrHeader[0] &&
            bytes[1] == kCdrHeader[1]),
        body_(ok_ ? bytes.subspan(kCdrHeader.size()) : std::span<const std::byte>()) {}

  bool ok() const noexcept { return ok_; }

  template <CdrPrimitive T>
  void operator()(T& value) {
    const std::byte* from = take(sizeof(T), sizeof(T));
    if (from == nullptr) return;
    if constexpr (std::same_as<T, bool>) {
      value = *from != std::byte{0};
    } else {
      std::memcpy(&value, from, sizeof(T));
    }
  }
  void operator()(std::string& text);
  void operator()(std::u16string& text);
  template <class T>
  void operator()(std::vector<T>& values) {
    if constexpr (CdrPrimitive<T> && !std::same_as<T, bool>) {
      const std::uint32_t size = count(sizeof(T));
      values.resize(size);
      bulk(values);
    } else {
      const std::uint32_t size = count(kCdrLeastSize<T>);
      values.resize(ok_ ? size : 0);
      for (std::size_t i = 0; ok_ && i < values.size(); ++i) {
        if constexpr (std::same_as<T, bool>) {
          bool value = false;
          (*this)(value);
          values[i] = value;
        } else {
          (*this)(values[i]);
        }
      }
    }
  }
  template <class Container, std::size_t kMost>
  void operator()(Bounded<Container, kMost>& values) {
    Container plain = std::move(values).take();
    (*this)(plain);
    if (plain.size() > kMost) {
      fail();
      plain.clear();
    }
    values = std::move(plain);
  }
  template <class T, std::size_t N>
  void operator()(std::array<T, N>& values) {
    if constexpr (CdrPrimitive<T> && !std::same_as<T, bool>) {
      bulk(values);
    } else {
      for (T& value : values) (*this)(value);
    }
  }
  template <class T>
  void operator()(T& message) {
    takt_visit_fields(*this, message);
  }
  void no_fields() {
    std::uint8_t ignored = 0;
    (*this)(ignored);
  }

 private:
  void fail() noexcept {
    ok_ = false;
    body_ = {};
    offset_ = 0;
  }
  /// Takes the next `size` bytes; returns nullptr if fewer are left.
  const std::byte* take(std::size_t size, std::size_t alignment) noexcept {
    const std::size_t padding = (alignment - offset_ % alignment) % alignment;
    const std::size_t left = body_.size() - offset_;
    if (!ok_ || padding > left || size > left - padding) return fail(), nullptr;
    const std::byte* from = body_.data() + offset_ + padding;
    offset_ += padding + size;
    return from;
  }
  /// Reads a number of elements; returns 0 and fails if the remaining bytes cannot contain them.
  std::uint32_t count(std::size_t least_size) noexcept {
    std::uint32_t value = 0;
    (*this)(value);
    if (value > (body_.size() - offset_) / least_size) fail();
    return ok_ ? value : 0;
  }
  template <class Container>
  void bulk(Container& values) {
    using T = typename Container::value_type;
    if (values.empty()) return;
    if (const std::byte* from = take(values.size() * sizeof(T), sizeof(T))) {
      std::memcpy(values.data(), from, values.size() * sizeof(T));
    }
  }

  bool ok_;
  std::span<const std::byte> body_;
  std::size_t offset_ = 0;
};

}  // namespace takt

#endif  // TAKT_MESSAGES_CDR_HPP_
