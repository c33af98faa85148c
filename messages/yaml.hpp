// Messages as YAML text, in the words of ROS 2's to_yaml().
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_YAML_HPP_
#define TAKT_MESSAGES_YAML_HPP_

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "takt/base/visibility.hpp"
#include "takt/messages/message_type.hpp"

namespace TAKT_PUBLIC takt {
namespace detail {

// What every type would compile again, see yaml.cpp.
std::string yaml_integer(std::int64_t value);
std::string yaml_unsigned(std::uint64_t value);
std::string yaml_real(double value);
std::string yaml_text(std::string_view text);
std::string yaml_text(std::u16string_view text);

template <class T>
std::string yaml_value(const T& value) {
  if constexpr (std::is_enum_v<T>) {
    return yaml_value(static_cast<std::underlying_type_t<T>>(value));
  } else if constexpr (std::is_same_v<T, bool>) {
    return value ? "true" : "false";
  } else if constexpr (std::is_floating_point_v<T>) {
    return yaml_real(static_cast<double>(value));
  } else if constexpr (std::is_integral_v<T>) {
    return std::is_signed_v<T> ? yaml_integer(static_cast<std::int64_t>(value))
                               : yaml_unsigned(static_cast<std::uint64_t>(value));
  } else {
    return yaml_text(value);
  }
}

template <class T>
concept YamlText = requires(const T& text) {
  yaml_text(text);
};
template <class T>
concept IsBounded = requires(const T& bounded) {
  bounded.get();
};
template <class T>
concept YamlList = !YamlText<T> && requires(const T& list) {
  list.begin();
  list.size();
};

/// Writes the fields of one message. It visits them in the order of their names in the type.
template <class Message>
class YamlFields {
 public:
  YamlFields(std::string& text, std::size_t indentation, bool is_flow)
      : text_(text), indentation_(indentation), is_flow_(is_flow) {}
  template <class T>
  void operator()(const T& value) {
    const std::string& name = message_type<Message>().fields[next_++].name;
    if (is_flow_) {
      if (next_ > 1) text_ += ", ";
      text_ += name + ": ";
      flow(value);
    } else {
      text_.append(indentation_, ' ') += name + ":";
      block(value, indentation_);
    }
  }
  void no_fields() { text_ += is_flow_ ? "null" : "null\n"; }

 private:
  template <class T>
  void flow(const T& value) {
    if constexpr (IsBounded<T>) {
      flow(value.get());
    } else if constexpr (takt::Message<T>) {
      text_ += '{';
      visit(value, 0);
      text_ += '}';
    } else if constexpr (YamlList<T>) {
      text_ += '[';
      std::size_t number = 0;
      for (const typename T::value_type& element : value) {
        if (number++ > 0) text_ += ", ";
        flow(element);
      }
      text_ += ']';
    } else {
      text_ += yaml_value(value);
    }
  }
  // Behind "name:" or "-".
  template <class T>
  void block(const T& value, std::size_t indentation) {
    if constexpr (IsBounded<T>) {
      block(value.get(), indentation);
    } else if constexpr (takt::Message<T>) {
      text_ += '\n';
      visit(value, indentation + 2);
    } else if constexpr (YamlList<T>) {
      text_ += value.size() == 0 ? " []\n" : "\n";
      for (const typename T::value_type& element : value) {
        text_.append(indentation, ' ') += '-';
        block(element, indentation);
      }
    } else {
      text_ += ' ' + yaml_value(value) + '\n';
    }
  }
  template <class T>
  void visit(const T& value, std::size_t indentation) {
    YamlFields<T> fields(text_, indentation, is_flow_);
    takt_visit_fields(fields, value);
  }

  std::string& text_;
  std::size_t indentation_;
  bool is_flow_;
  std::size_t next_ = 0;
};

}  // namespace detail

template <Message M>
std::string to_yaml(const M& message, bool use_flow_style) {
  std::string text;
  detail::YamlFields<M> fields(text, 0, use_flow_style);
  takt_visit_fields(fields, message);
  return use_flow_style && text != "null" ? '{' + text + '}' : text;
}

}  // namespace takt

#endif  // TAKT_MESSAGES_YAML_HPP_
