// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/cdr.hpp"

namespace takt {

void ByteBuffer::grow(std::size_t wanted) {
  std::size_t capacity = capacity_ == 0 ? 256 : capacity_;
  while (capacity < wanted) capacity *= 2;
  auto larger = std::make_unique_for_overwrite<std::byte[]>(capacity);
  if (size_ != 0) std::memcpy(larger.get(), data_.get(), size_);
  data_ = std::move(larger);
  capacity_ = capacity;
}

void CdrWriter::operator()(const std::string& text) {
  (*this)(static_cast<std::uint32_t>(text.size() + 1));  // with the zero at the end
  put(text.c_str(), text.size() + 1, 1);
}

void CdrWriter::operator()(const std::u16string& text) {
  (*this)(static_cast<std::uint32_t>(text.size()));
  for (const char16_t character : text) (*this)(static_cast<std::uint32_t>(character));
}

void CdrReader::operator()(std::string& text) {
  const std::uint32_t size = count(1);
  const std::byte* from = take(size, 1);
  if (!ok_ || size == 0) return text.clear();  // some senders omit the zero of an empty string
  if (from[size - 1] != std::byte{0}) return fail();
  text.assign(reinterpret_cast<const char*>(from), size - 1);
}

void CdrReader::operator()(std::u16string& text) {
  text.resize(count(sizeof(std::uint32_t)));
  for (char16_t& character : text) {
    std::uint32_t value = 0;
    (*this)(value);
    if (value > 0xffff) return fail();
    character = static_cast<char16_t>(value);
  }
}

}  // namespace takt
