// YAML as a tree, by yaml-cpp's events.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <clocale>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <optional>
#include <sstream>

#include <fmt/format.h>
#include <yaml-cpp/depthguard.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include "takt/containers/configuration/document.hpp"

namespace takt::document {
namespace {

using Content = decltype(Value::content);

// Converts the whole text to a number, if possible. `how` is the base or the format.
template <class Number, class How>
std::optional<Number> number(std::string_view text, How how) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, how);
  if (error == std::errc::invalid_argument || end != text.data() + text.size()) return {};
  if (error != std::errc{}) {
    throw Error(fmt::format("the number {} cannot be held", text),
                "write a smaller one, or put it in quotes if it is a text");
  }
  return value;
}

// Resolves text without quotes by the rules of YAML 1.2's core schema.
Content resolve(const std::string& text) {
  const auto is_one_of = [](std::string_view word, std::initializer_list<std::string_view> words) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  if (is_one_of(text, {"true", "True", "TRUE"})) return true;
  if (is_one_of(text, {"false", "False", "FALSE"})) return false;
  if (is_one_of(text, {".nan", ".NaN", ".NAN"})) return std::numeric_limits<double>::quiet_NaN();
  const bool has_sign = text.starts_with('-') || text.starts_with('+');
  const std::string_view digits = std::string_view(text).substr(has_sign ? 1 : 0);
  if (is_one_of(digits, {".inf", ".Inf", ".INF"})) {
    const double infinity = std::numeric_limits<double>::infinity();
    return text.starts_with('-') ? -infinity : infinity;
  }
  if (text.starts_with("0x") || text.starts_with("0o")) {
    const bool has_digits = std::isxdigit(static_cast<unsigned char>(text[2])) != 0;
    const auto value = number<std::int64_t>(digits.substr(2), text[1] == 'x' ? 16 : 8);
    return has_digits && value ? Content(*value) : Content(text);
  }
  // from_chars knows more words for infinity, and a second sign.
  if (digits.empty() ||
      (std::isdigit(static_cast<unsigned char>(digits[0])) == 0 && !digits.starts_with('.'))) {
    return text;
  }
  const std::string_view without_plus = text.starts_with('+') ? digits : std::string_view(text);
  if (const auto value = number<std::int64_t>(without_plus, 10)) return *value;
  if (const auto value = number<double>(without_plus, std::chars_format::general)) return *value;
  return text;
}

/// Parses in the C locale, whatever the locale of the program is.
std::optional<double> decimal_number(const std::string& text) {
  static const locale_t c = newlocale(LC_ALL_MASK, "C", nullptr);
  const std::size_t first = text.find_first_not_of("+-");
  const bool is_number = first != text.npos && first <= 1 &&
                         (std::isdigit(static_cast<unsigned char>(text[first])) != 0 ||
                          text[first] == '.');  // "nan" and "inf" are words
  char* end = nullptr;
  const double value = is_number ? strtod_l(text.c_str(), &end, c) : 0;
  if (!is_number || end != text.c_str() + text.size()) return {};
  if (std::isinf(value)) {
    throw Error(fmt::format("the number {} cannot be held", text),
                "write a smaller one, or put it in quotes if it is a text");
  }
  return value;
}

// Resolves text without quotes as rcl does (rcl_yaml_param_parser 9.2), except "nan" and "inf",
// which are words as in its next version.
Content resolve_parameter(const std::string& text) {
  for (const char* word :
       {"y", "Y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"}) {
    if (text == word) return true;
  }
  for (const char* word :
       {"n", "N", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"}) {
    if (text == word) return false;
  }
  const std::size_t sign = text.starts_with('+') || text.starts_with('-') ? 1 : 0;
  const std::string unsigned_text = text.substr(sign);
  for (const char* word : {".nan", ".NaN", ".NAN"}) {
    if (text == word) return std::numeric_limits<double>::quiet_NaN();
  }
  for (const char* word : {".inf", ".Inf", ".INF"}) {
    const double infinity = std::numeric_limits<double>::infinity();
    if (unsigned_text == word) return text.starts_with('-') ? -infinity : infinity;
  }
  errno = 0;
  char* end = nullptr;
  const std::int64_t integer = std::strtoll(text.c_str(), &end, /*base=*/0);
  if (errno == 0 && end != text.c_str() && end == text.c_str() + text.size()) return integer;
  if (const auto value = decimal_number(text)) return *value;
  return text;
}

std::string shown(const Content& content) {
  if (const auto* text = std::get_if<std::string>(&content)) return fmt::format("\"{}\"", *text);
  if (const auto* value = std::get_if<bool>(&content)) return *value ? "true" : "false";
  if (const auto* value = std::get_if<std::int64_t>(&content)) return fmt::format("{}", *value);
  if (const auto* value = std::get_if<double>(&content)) return fmt::format("{:#}", *value);
  return "";
}

/// Compares two scalars.
bool is_same(const Content& a, const Content& b) {
  return a.index() == b.index() && shown(a) == shown(b);
}

/// The alternative of Content that a tag selects.
std::optional<std::size_t> number_tag(std::string_view tag) {
  if (tag == "tag:yaml.org,2002:bool") return Content(true).index();
  if (tag == "tag:yaml.org,2002:int") return Content(std::int64_t{0}).index();
  if (tag == "tag:yaml.org,2002:float") return Content(0.0).index();
  return {};
}

// Uses events, because yaml-cpp's own tree expands every alias, recurses endlessly into an alias of
// its own container, and has no lines of keys.
class YamlHandler : public YAML::EventHandler {
 public:
  using Mark = YAML::Mark;
  using Anchor = YAML::anchor_t;

  YamlHandler(std::string_view text, Errors& errors, Rules rules)
      : text_(text), errors_(errors), rules_(rules), builder_(errors, rules) {}

  /// Call it after the last document.
  Value take_root() {
    if (key_error_) {
      errors_.fail(key_error_->first, key_error_->second, "write a word before the ':'");
    }
    return builder_.take_root();
  }

  void OnDocumentStart(const Mark& mark) override {
    // yaml-cpp also starts a new document where a line does not fit the lines above.
    if (++documents_ == 2) {
      errors_.fail(line(mark), "this line does not continue the lines above",
                   "correct the indentation, or remove '---': a file is one document");
    }
  }
  void OnDocumentEnd() override {}

  void OnNull(const Mark& mark, Anchor anchor) override {
    // In ROS 2's parameter files, `null` and `~` are words.
    const std::string_view rest = text_.substr(static_cast<std::size_t>(mark.pos));
    const std::size_t length = rest.starts_with('~')                            ? 1
                               : rest.starts_with('n') || rest.starts_with('N') ? 4
                                                                                : 0;
    if (rules_ == Rules::parameters && length != 0) {
      return OnScalar(mark, "?", anchor, std::string(rest.substr(0, length)));
    }
    if (!is_value(mark, "a key is empty")) return;
    // yaml-cpp gives an empty value the position of the next token, maybe lines below.
    const std::string_view before = text_.substr(0, static_cast<std::size_t>(mark.pos));
    const std::string_view gap = before.substr(before.find_last_not_of(" \t\r\n") + 1);
    const auto lines_too_far = static_cast<int>(std::count(gap.begin(), gap.end(), '\n'));
    remember(anchor, builder_.add({.line = line(mark) - lines_too_far}));
  }
  void OnAlias(const Mark& mark, Anchor anchor) override {
    if (!is_value(mark, "an alias is used as a key")) return;
    if (rules_ == Rules::parameters) {
      errors_.fail(line(mark), "ROS 2 reads no alias ('*…') here", "write the value instead");
    }
    const auto target = anchors_.find(anchor);
    if (target == anchors_.end()) {
      errors_.fail(line(mark), "this alias refers to a value that contains it",
                   "write the value instead");
    }
    Value value = target->second;
    value.line = line(mark);
    builder_.add(std::move(value));
  }
  void OnScalar(const Mark& mark, const std::string& tag, Anchor anchor,
                const std::string& text) override {
    if (key_error_) return;
    const bool is_parameter = rules_ == Rules::parameters;
    // rcl ignores tags; here they must be right.
    const std::optional<std::size_t> tagged = is_parameter ? number_tag(tag) : std::nullopt;
    const bool is_plain = tag == "?" || tagged;
    if (tag != "tag:yaml.org,2002:str" && !tagged) check_tag(mark, tag);
    if (builder_.wants_key()) {
      if (is_plain && text == "<<") {
        errors_.fail(line(mark), "a merge key is not supported", "write the values instead");
      }
      return builder_.key(text, line(mark));
    }
    Value value{.line = line(mark), .content = text};
    errors_.passes(value.line, [&] {
      if (!is_plain) return;
      value.content = is_parameter ? resolve_parameter(text) : resolve(text);
      if (tagged && value.content.index() != *tagged) {
        throw Error(fmt::format("ROS 2 does not convert {} to what its tag says", text),
                    "remove the tag, and write the value so that it has this type");
      }
      if (!is_parameter && !is_same(value.content, resolve_parameter(text))) value.ambiguous = text;
    });
    remember(anchor, builder_.add(std::move(value)));
  }
  void OnSequenceStart(const Mark& mark, const std::string& tag, Anchor anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, List());
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const Mark& mark, const std::string& tag, Anchor anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, Map());
  }
  void OnMapEnd() override { close(); }

 private:
  static int line(const Mark& mark) { return mark.line + 1; }

  // Whether the event is a value. An invalid key is often caused by an open bracket, for which the
  // parser reports a better error later: so remember the error, and ignore events until then.
  bool is_value(const Mark& mark, const std::string& what) {
    if (!key_error_ && builder_.wants_key()) key_error_.emplace(line(mark), what);
    return !key_error_;
  }
  void check_tag(const Mark& mark, const std::string& tag) const {
    if (tag.empty() || tag == "?" || tag == "!") return;
    errors_.fail(line(mark), "a tag ('!…') is not supported", "remove it");
  }
  void open(const Mark& mark, const std::string& tag, Anchor anchor, Content content) {
    if (!is_value(mark, "a list or a map is used as a key")) return;
    check_tag(mark, tag);
    builder_.open({.line = line(mark), .content = std::move(content)});
    open_anchors_.push_back(anchor);
  }
  void close() {
    if (key_error_) return;
    const Anchor anchor = open_anchors_.back();
    open_anchors_.pop_back();
    remember(anchor, builder_.close());
  }
  void remember(Anchor anchor, const Value& value) {
    if (anchor == YAML::NullAnchor) return;
    builder_.account_for(value);
    anchors_[anchor] = value;
  }

  const std::string_view text_;
  Errors& errors_;
  const Rules rules_;
  Builder builder_;
  int documents_ = 0;
  std::optional<std::pair<int, std::string>> key_error_;  // its line, and what is wrong
  std::vector<Anchor> open_anchors_;                      // of the containers that are open
  std::map<Anchor, Value> anchors_;                       // of complete values
};

// The most frequent mistakes, in words for users who do not know yaml-cpp.
struct Explanation {
  std::string_view message;  // yaml-cpp's
  const char* what;
  const char* what_to_do;
};
const Explanation kExplanations[] = {
    {YAML::ErrorMsg::DOC_IN_SCALAR, "a text in quotes does not end", "close the quotes"},
    {YAML::ErrorMsg::MAP_VALUE, "a ':' is not allowed here",
     "put the text in quotes, indent it as the line above, or add ': ' to that line"},
    {YAML::ErrorMsg::BLOCK_ENTRY, "a list cannot begin here", "begin it on a new line"},
    {YAML::ErrorMsg::UNKNOWN_TOKEN, "no text begins with this character", "put it in quotes"},
    {YAML::ErrorMsg::END_OF_MAP, "this does not continue the map above",
     "correct the indentation, or write a key before it"},
    {YAML::ErrorMsg::END_OF_SEQ, "this does not continue the list above",
     "correct the indentation, or write '- ' before it"},
    {YAML::ErrorMsg::END_OF_MAP_FLOW, "a ',' or a '}' is missing",
     "close every '{' with '}', and separate items with ','"},
    {YAML::ErrorMsg::END_OF_SEQ_FLOW, "a ',' or a ']' is missing",
     "close every '[' with ']', and separate items with ','"},
    {YAML::ErrorMsg::FLOW_END, "this closing bracket has no opening one",
     "close every '[' with ']', and every '{' with '}'"},
};

[[noreturn]] void fail(const YAML::Exception& exception, const std::string& text,
                       const Errors& errors) {
  // If the file ends too early, report its last line, not the empty ones after it.
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(text.find_last_not_of(" \t\r\n"));
  const int last_line = 1 + static_cast<int>(std::count(text.begin(), end, '\n'));
  const int line = std::min(exception.mark.line + 1, last_line);
  std::istringstream lines(text);
  std::string content;
  for (int i = 0; i < line; ++i) std::getline(lines, content);
  if (content.substr(0, content.find_first_not_of(" \t")).find('\t') != std::string::npos) {
    errors.fail(line, "the indentation contains a tab", "indent with spaces");
  }
  for (const Explanation& known : kExplanations) {
    if (exception.msg == known.message) errors.fail(line, known.what, known.what_to_do);
  }
  if (dynamic_cast<const YAML::DeepRecursion*>(&exception) != nullptr) {
    errors.fail(line, "this is nested too deeply", "use fewer levels");
  }
  // Leave out the text after a colon: it is of the file, which may be none of ours, see
  // check_is_ours().
  errors.fail(line, exception.msg.substr(0, exception.msg.find(": ")),
              "write valid YAML here: check indentation, brackets, quotes and anchors");
}

}  // namespace

void check_is_unambiguous(const Value& value, Errors& errors) {
  if (const auto* list = std::get_if<List>(&value.content)) {
    for (const Value& item : *list) check_is_unambiguous(item, errors);
  }
  const std::string& text = value.ambiguous;
  if (text.empty()) return;
  const std::string here = shown(resolve(text)), there = shown(resolve_parameter(text));
  errors.add(
      value.line,
      fmt::format("{} is {} in YAML 1.2, and {} in parameter files of ROS 2", text, here, there),
      fmt::format("write {} or {}", here, there));
}

Value parse_yaml(const std::string& text, Errors& errors, Rules rules) {
  // Without an end mark, yaml-cpp accepts a truncated text in quotes.
  const std::string ended = text + "\n...\n";
  std::istringstream stream(ended);
  YamlHandler handler(ended, errors, rules);
  try {
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(handler)) {
    }
  } catch (const YAML::Exception& exception) {
    fail(exception, text, errors);
  }
  return handler.take_root();
}

}  // namespace takt::document
