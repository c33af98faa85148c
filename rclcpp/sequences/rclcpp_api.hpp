// The API of the sequences on top of rclcpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_SEQUENCES_RCLCPP_API_HPP_
#define RCLCPP_SEQUENCES_RCLCPP_API_HPP_

#include <future>
#include <memory>
#include <string>
#include <vector>

#include "takt/executors/sequences/api.hpp"

#include "rclcpp/rclcpp.hpp"

namespace rclcpp {

/// Calls rclcpp for everything that rclcpp has, with the forms of callbacks in turn; the rest
/// (guard conditions, coroutines, actions, events) is Takt's, on the same nodes. One object runs
/// one program.
class RclcppApi final : public takt::sequences::Api {
 public:
  RclcppApi();

  std::vector<std::string> executor_names() const override;
  std::unique_ptr<takt::Executor> make_executor(const std::string& type,
                                                const takt::ExecutorOptions& options) override;
  const takt::Clock& clock_of_limits(const takt::Clock&) const override {
    return takt::Clock::steady();
  }

  NodePtr make_node(const std::string& name, const takt::NodeOptions& options) override;
  GroupPtr make_group(const NodePtr& node, const std::string& name,
                      CallbackGroupType type) override;
  std::shared_ptr<takt::Timer> make_timer(const NodePtr& node, const std::string& name,
                                          takt::Nanoseconds period, std::function<void()> callback,
                                          const GroupPtr& group) override;
  std::shared_ptr<takt::SubscriptionBase> make_subscription(const NodePtr& node,
                                                            const std::string& topic,
                                                            std::size_t depth,
                                                            std::function<void()> callback,
                                                            const GroupPtr& group) override;
  std::function<void()> make_publish(
      const NodePtr& node,
      std::shared_ptr<takt::Publisher<takt::sequences::Number>> publisher) override;

  ServicePtr make_service(const NodePtr& node, const std::string& name, Serve callback,
                          const GroupPtr& group) override;
  ServicePtr make_service(const NodePtr& node, const std::string& name, ServeLater callback,
                          const GroupPtr& group) override;
  void respond(const ServicePtr& service, takt::RequestId id, int value) override;
  ClientPtr make_client(const NodePtr& node, const std::string& name, takt::ClientOptions& options,
                        const GroupPtr& group) override;
  void send_request(const ClientPtr& client, int number, Answered callback) override;
  std::unique_ptr<takt::sequences::Asked> ask(const ClientPtr& client, int number) override;

  void declare_parameter(const NodePtr& node) override;
  std::shared_ptr<const void> add_on_set(const NodePtr& node,
                                         std::function<bool(std::int64_t)> allows) override;
  bool set_parameter(const NodePtr& node, std::int64_t value) override;
  std::int64_t get_parameter(const NodePtr& node) override;

  const char* call_own(std::uint8_t what, const std::function<std::uint8_t()>& next) override;
  std::string left_behind() const override;

 private:
  using Response = takt::sequences::Twice::Response;

  const Context::SharedPtr context_ = std::make_shared<Context>();
  std::vector<std::shared_future<std::shared_ptr<Response>>> answers_;
  unsigned form_ = 0;  // selects the form of the next callback
};

}  // namespace rclcpp

#endif  // RCLCPP_SEQUENCES_RCLCPP_API_HPP_
