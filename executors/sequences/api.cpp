// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/sequences/api.hpp"

#include <utility>

namespace takt::sequences {
namespace {

class AskedTakt final : public Asked {
 public:
  explicit AskedTakt(Future<Client<Twice>::Answer> future) : future_(std::move(future)) {}
  FutureReturnCode spin(Executor& executor, Nanoseconds limit) override {
    return executor.spin_until_future_complete(future_, limit);
  }
  bool is_ready() const override { return future_.ready(); }
  const Twice::Response* answer() override {
    const auto& answer = future_.get();
    return answer ? &*answer : nullptr;
  }

 private:
  const Future<Client<Twice>::Answer> future_;
};

}  // namespace

std::vector<std::string> Api::executor_names() const {
  return executors().names();
}
std::unique_ptr<Executor> Api::make_executor(const std::string& type,
                                             const ExecutorOptions& options) {
  return executors().make(type, options);
}

// ---- Nodes ----

Api::NodePtr Api::make_node(const std::string& name, const NodeOptions& options) {
  return std::make_shared<Node>(name, options);
}
Api::GroupPtr Api::make_group(const NodePtr& node, const std::string& name,
                              CallbackGroupType type) {
  return node->create_callback_group(name, type);
}
std::shared_ptr<Timer> Api::make_timer(const NodePtr& node, const std::string& name,
                                       Nanoseconds period, std::function<void()> callback,
                                       const GroupPtr& group) {
  return node->create_timer(name, period, std::move(callback), group);
}
std::shared_ptr<SubscriptionBase> Api::make_subscription(const NodePtr& node,
                                                         const std::string& topic,
                                                         std::size_t depth,
                                                         std::function<void()> callback,
                                                         const GroupPtr& group) {
  return node->create_subscription<Number>(
      topic, depth, [callback = std::move(callback)](const Number&) { callback(); }, group);
}
std::function<void()> Api::make_publish(const NodePtr&,
                                        std::shared_ptr<Publisher<Number>> publisher) {
  return [publisher = std::move(publisher)] { publisher->publish(Number{1}); };
}

// ---- Services ----

Api::ServicePtr Api::make_service(const NodePtr& node, const std::string& name, Serve callback,
                                  const GroupPtr& group) {
  return node->create_service<Twice>(name, std::move(callback), group);
}
Api::ServicePtr Api::make_service(const NodePtr& node, const std::string& name, ServeLater callback,
                                  const GroupPtr& group) {
  return node->create_service<Twice>(name, std::move(callback), group);
}
void Api::respond(const ServicePtr& service, RequestId id, int value) {
  service->send_response(id, {value});
}
Api::ClientPtr Api::make_client(const NodePtr& node, const std::string& name,
                                ClientOptions& options, const GroupPtr& group) {
  return node->create_client<Twice>(name, options, group);
}
void Api::send_request(const ClientPtr& client, int number, Answered callback) {
  client->async_send_request({number}, std::move(callback));
}
std::unique_ptr<Asked> Api::ask(const ClientPtr& client, int number) {
  return std::make_unique<AskedTakt>(client->async_send_request({number}));
}

// ---- Parameters ----

void Api::declare_parameter(const NodePtr& node) {
  node->declare_parameter(kParameter, 0, {.integer_range = IntegerRange{0, 100}});
}
std::shared_ptr<const void> Api::add_on_set(const NodePtr& node,
                                            std::function<bool(std::int64_t)> allows) {
  return node->add_on_set_parameters_callback(
      [allows = std::move(allows)](const Parameters& values) {
        return SetParametersResult{allows(std::get<std::int64_t>(values.at(kParameter))), "odd"};
      });
}
bool Api::set_parameter(const NodePtr& node, std::int64_t value) {
  return node->set_parameters_atomically({{kParameter, value}}).successful;
}
std::int64_t Api::get_parameter(const NodePtr& node) {
  return node->get_parameter<std::int64_t>(kParameter);
}

}  // namespace takt::sequences
