// JSON as a tree, by nlohmann's events.
// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <iterator>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "takt/containers/configuration/document.hpp"

namespace takt::document {
namespace {

// nlohmann's events have no lines, so the parser reads through this iterator, which gives the
// position.
class TrackingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  TrackingIterator(const char* at, const char** position) : at_(at), position_(position) {}

  reference operator*() const { return *at_; }
  TrackingIterator& operator++() {
    *position_ = ++at_;
    return *this;
  }
  TrackingIterator operator++(int) {
    TrackingIterator before = *this;
    ++*this;
    return before;
  }
  bool operator==(const TrackingIterator& other) const { return at_ == other.at_; }
  bool operator!=(const TrackingIterator& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  const char** position_;
};

class JsonHandler {
 public:
  JsonHandler(std::string_view text, Errors& errors)
      : errors_(errors), builder_(errors), position_(text.data()), counted_(text.data()) {}

  const char** position() { return &position_; }
  Value take_root() { return builder_.take_root(); }

  bool null() { return add({}); }
  bool boolean(bool value) { return add(value); }
  bool number_integer(std::int64_t value) { return add(value); }
  bool number_unsigned(std::uint64_t value) {
    if (value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
      errors_.add(line(), fmt::format("the number {} cannot be held", value),
                  "write a smaller one");
    }
    return add(static_cast<std::int64_t>(value));
  }
  bool number_float(double value, const std::string&) { return add(value); }
  bool string(std::string& value) { return add(std::move(value)); }
  bool binary(const nlohmann::json::binary_t&) { return false; }  // JSON as text has none
  bool key(std::string& name) {
    builder_.key(std::move(name), line());
    return true;
  }
  bool start_object(std::size_t) { return open(Map()); }
  bool start_array(std::size_t) { return open(List()); }
  bool end_object() { return close(); }
  bool end_array() { return close(); }

  // "[json.exception.parse_error.101] parse error at line 3, column 5: what is wrong; details"
  bool parse_error(std::size_t, const std::string&, const std::exception& exception) {
    std::string what = exception.what();
    what.erase(0, what.find("] ") + 2);
    if (what.starts_with("parse error at")) what.erase(0, what.find(": ") + 2);
    // Do not quote the file, which may be none of ours: see check_is_ours().
    if (const std::size_t read = what.find("; last read: "); read != what.npos) {
      const std::size_t expected = what.rfind("; expected");
      what.erase(read, expected == what.npos || expected < read ? what.npos : expected - read);
    }
    // A semicolon separates the problem from the advice, so the problem must not contain one.
    for (std::size_t at = 0; (at = what.find(';', at)) != std::string::npos;) what[at] = ',';
    errors_.fail(line(), what, "write valid JSON here");
  }

 private:
  // The line of the last token. To find the end of a number, the parser reads one more character,
  // which may be a line break.
  int line() {
    for (; counted_ + 1 < position_; ++counted_) {
      if (*counted_ == '\n') ++line_;
    }
    return line_;
  }
  bool add(decltype(Value::content) content) {
    builder_.add({.line = line(), .content = std::move(content)});
    return true;
  }
  bool open(decltype(Value::content) content) {
    builder_.open({.line = line(), .content = std::move(content)});
    return true;
  }
  bool close() {
    builder_.close();
    return true;
  }

  Errors& errors_;
  Builder builder_;
  const char* position_;
  const char* counted_;  // lines are counted up to here
  int line_ = 1;
};

}  // namespace

Value parse_json(std::string_view text, Errors& errors) {
  // A truncated file ends in its last line, not in the empty one after it.
  text = text.substr(0, text.find_last_not_of(" \t\r\n") + 1);
  JsonHandler handler(text, errors);
  nlohmann::json::sax_parse(TrackingIterator(text.data(), handler.position()),
                            TrackingIterator(text.data() + text.size(), handler.position()),
                            &handler);
  return handler.take_root();
}

}  // namespace takt::document
