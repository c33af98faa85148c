// Options of rclcpp::init.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__INIT_OPTIONS_HPP_
#define RCLCPP__INIT_OPTIONS_HPP_

#include <cstddef>
#include <optional>

namespace rclcpp {

/// Thread safety: a value. Real-time: set-up only.
class InitOptions {
 public:
  bool shutdown_on_signal = true;

  InitOptions() = default;
  InitOptions(const InitOptions&) = default;
  InitOptions& operator=(const InitOptions&) = default;
  ~InitOptions() {}  // NOLINT: not trivial, see Time

  InitOptions& auto_initialize_logging(bool initialize) {
    return initialize_logging_ = initialize, *this;
  }
  bool auto_initialize_logging() const { return initialize_logging_; }
  void set_domain_id(std::size_t domain) { domain_ = domain; }
  void use_default_domain_id() { domain_.reset(); }
  /// The domain id that was set, or else the one of the environment.
  std::size_t get_domain_id() const;

 private:
  bool initialize_logging_ = true;
  std::optional<std::size_t> domain_;
};

}  // namespace rclcpp

#endif  // RCLCPP__INIT_OPTIONS_HPP_
