// SPDX-License-Identifier: Apache-2.0
#include "rclcpp_api.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "own_calls.hpp"

namespace rclcpp {
namespace {

using takt::sequences::Api;
using takt::sequences::kParameter;
using takt::sequences::Number;
using takt::sequences::Twice;

/// Deleter of a Takt object that an rclcpp handle owns: drops the handle instead of deleting the
/// object.
template <class T>
struct Owner {
  std::shared_ptr<T> handle;
  void operator()(const void*) noexcept { handle.reset(); }
};
template <class Core, class T>
std::shared_ptr<Core> owned(Core* core, std::shared_ptr<T> handle) {
  return std::shared_ptr<Core>(core, Owner<T>{std::move(handle)});
}
/// The rclcpp handle of a Takt object; nullptr: Takt's API made the object.
template <class T, class Core>
std::shared_ptr<T> handle_of(const std::shared_ptr<Core>& core) {
  const auto* const owner = std::get_deleter<Owner<T>>(core);
  return owner != nullptr ? owner->handle : nullptr;
}

/// Translates exceptions of rclcpp into takt::Error.
template <class Call>
auto spoken(Call&& call) {
  try {
    return call();
  } catch (const std::runtime_error& error) {
    throw takt::Error(error.what());
  } catch (const std::invalid_argument& error) {
    throw takt::Error(error.what());
  }
}

class Named : public Executor {
 public:
  Named(const ExecutorOptions& options, const std::string& type, const takt::ExecutorOptions& how)
      : Executor(options, type, how) {}
};

class SpokenExecutor final : public takt::Executor {
 public:
  SpokenExecutor(const ExecutorOptions& options, const std::string& type,
                 const takt::ExecutorOptions& how)
      : executor_(options, type, how) {}

  void add_node(const Api::NodePtr& core) override {
    const auto node = handle_of<Node>(core);
    if (node == nullptr) return executor_.takt().add_node(core);
    spoken([&] { executor_.add_node(node); });
  }
  void remove_node(const Api::NodePtr& core) override {
    const auto node = handle_of<Node>(core);
    if (node == nullptr) return executor_.takt().remove_node(core);
    spoken([&] { executor_.remove_node(node); });
  }
  void add_callback_group(const Api::GroupPtr& group, const Api::NodePtr& core) override {
    const auto node = handle_of<Node>(core);
    if (node == nullptr) return executor_.takt().add_callback_group(group, core);
    spoken([&] { executor_.add_callback_group(group, node->get_node_base_interface()); });
  }
  void remove_callback_group(const Api::GroupPtr& group, const Api::NodePtr& core) override {
    if (handle_of<Node>(core) == nullptr) {
      return executor_.takt().remove_callback_group(group, core);
    }
    spoken([&] { executor_.remove_callback_group(group); });
  }

  void spin(const takt::ExceptionHandler&) override {
    spoken([&] { executor_.spin(); });
  }
  void spin_once(takt::Nanoseconds timeout) override {
    spoken([&] { executor_.spin_once(timeout); });
  }
  void spin_some(takt::Nanoseconds max_duration) override {
    spoken([&] { executor_.spin_some(max_duration); });
  }
  void spin_all(takt::Nanoseconds max_duration) override {
    spoken([&] { executor_.spin_all(max_duration); });
  }
  template <class F>
  takt::FutureReturnCode spin_until(const F& future, takt::Nanoseconds limit) {
    return spoken([&] {
      switch (executor_.spin_until_future_complete(future, limit)) {
        case FutureReturnCode::SUCCESS:
          return takt::FutureReturnCode::SUCCESS;
        case FutureReturnCode::TIMEOUT:
          return takt::FutureReturnCode::TIMEOUT;
        default:
          return takt::FutureReturnCode::INTERRUPTED;
      }
    });
  }
  void cancel() noexcept override { executor_.cancel(); }

  bool is_spinning() const noexcept override { return executor_.takt().is_spinning(); }
  void release_timers(bool released) noexcept override {
    executor_.takt().release_timers(released);
  }
  std::size_t pending() const noexcept override { return executor_.takt().pending(); }
  std::vector<takt::CallbackStatistics> statistics() const override {
    return executor_.takt().statistics();
  }
  std::vector<takt::ThreadStatistics> thread_statistics() const override {
    return executor_.takt().thread_statistics();
  }

 private:
  takt::FutureReturnCode spin_until_complete(takt::FutureState& future,
                                             takt::Nanoseconds timeout) override {
    struct Looked {
      const takt::FutureState& future;
      std::future_status wait_for(std::chrono::seconds) const {
        return future.ready() ? std::future_status::ready : std::future_status::timeout;
      }
    };
    return spin_until(Looked{future}, timeout);
  }

  mutable Named executor_;
};

class AskedRclcpp final : public takt::sequences::Asked {
 public:
  explicit AskedRclcpp(Client<Twice>::SharedFuture future) : future_(std::move(future)) {}
  takt::FutureReturnCode spin(takt::Executor& executor, takt::Nanoseconds limit) override {
    return static_cast<SpokenExecutor&>(executor).spin_until(future_, limit);
  }
  bool is_ready() const override {
    return future_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }
  const Twice::Response* answer() override {
    try {
      return future_.get().get();
    } catch (const std::future_error&) {  // the client has gone
      return nullptr;
    }
  }

 private:
  const Client<Twice>::SharedFuture future_;
};

}  // namespace

RclcppApi::RclcppApi() {
  context_->enter_container({});  // valid as after init, but without DDS
}

std::vector<std::string> RclcppApi::executor_names() const {
  std::vector<std::string> names = takt::executors().names();
  std::erase_if(names, [](const std::string& name) {  // as TAKT_EXECUTOR is none of rclcpp's
    const takt::ExecutorTraits traits = takt::executors().traits(name);
    return traits.frozen || traits.triggered;
  });
  return names;
}
std::unique_ptr<takt::Executor> RclcppApi::make_executor(const std::string& type,
                                                         const takt::ExecutorOptions& options) {
  ExecutorOptions own;
  own.context = context_;
  return std::make_unique<SpokenExecutor>(own, type, options);
}

// ---- Nodes ----

Api::NodePtr RclcppApi::make_node(const std::string& name, const takt::NodeOptions& options) {
  const auto node =
      std::make_shared<Node>(name, NodeOptions(options).context(context_).enable_rosout(false));
  return owned(node->get_node_base_interface()->takt_node().get(), node);
}
Api::GroupPtr RclcppApi::make_group(const NodePtr& core, const std::string& name,
                                    CallbackGroupType type) {
  const auto node = handle_of<Node>(core);
  if (node == nullptr) return Api::make_group(core, name, type);
  return node->create_callback_group(type);
}

std::shared_ptr<takt::Timer> RclcppApi::make_timer(const NodePtr& core, const std::string& name,
                                                   takt::Nanoseconds period,
                                                   std::function<void()> callback,
                                                   const GroupPtr& group) {
  const auto node = handle_of<Node>(core);
  if (node == nullptr) return Api::make_timer(core, name, period, std::move(callback), group);
  TimerBase::SharedPtr timer;
  switch (++form_ % 3) {
    case 0:
      timer = node->create_wall_timer(period, std::move(callback), group);
      break;
    case 1:
      timer = node->create_timer(
          period, [callback = std::move(callback)](const TimerInfo&) { callback(); }, group);
      break;
    default:
      timer = node->create_wall_timer(
          period,
          [callback = std::move(callback)](TimerBase& self) {
            callback();
            (void)self.is_canceled();  // even if the callback has dropped its handle
          },
          group);
  }
  return owned(timer->entity().get(), timer);
}

std::shared_ptr<takt::SubscriptionBase> RclcppApi::make_subscription(const NodePtr& core,
                                                                     const std::string& topic,
                                                                     std::size_t depth,
                                                                     std::function<void()> callback,
                                                                     const GroupPtr& group) {
  const auto node = handle_of<Node>(core);
  if (node == nullptr) {
    return Api::make_subscription(core, topic, depth, std::move(callback), group);
  }
  SubscriptionOptions options;
  options.callback_group = group;
  SubscriptionBase::SharedPtr subscription;
  switch (++form_ % 3) {
    case 0:
      subscription = node->create_subscription<Number>(
          topic, depth, [callback](const Number&) { callback(); }, options);
      break;
    case 1:
      subscription = node->create_subscription<Number>(
          topic, depth, [callback](std::shared_ptr<const Number>) { callback(); }, options);
      break;
    default:
      subscription = node->create_subscription<Number>(
          topic, depth, [callback](std::unique_ptr<Number>, const MessageInfo&) { callback(); },
          options);
  }
  return owned(subscription->entity().get(), subscription);
}

std::function<void()> RclcppApi::make_publish(const NodePtr& core,
                                              std::shared_ptr<takt::Publisher<Number>> publisher) {
  return
      [this, publisher = handle_of<Node>(core)->create_publisher<Number>(publisher->topic(), 4)] {
        if (++form_ % 2 == 0) {
          publisher->publish(Number{1});
        } else {
          publisher->publish(std::make_unique<Number>());
        }
      };
}

// ---- Services ----

Api::ServicePtr RclcppApi::make_service(const NodePtr& core, const std::string& name,
                                        Serve callback, const GroupPtr& group) {
  const auto node = handle_of<Node>(core);
  if (node == nullptr) return Api::make_service(core, name, std::move(callback), group);
  const auto service = node->create_service<Twice>(
      name,
      [callback = std::move(callback)](std::shared_ptr<Twice::Request> request,
                                       std::shared_ptr<Twice::Response> response) {
        callback(*request, *response);
      },
      ServicesQoS(), group);
  return owned(static_cast<takt::Service<Twice>*>(service->entity().get()), service);
}
Api::ServicePtr RclcppApi::make_service(const NodePtr& core, const std::string& name,
                                        ServeLater callback, const GroupPtr& group) {
  const auto node = handle_of<Node>(core);
  if (node == nullptr) return Api::make_service(core, name, std::move(callback), group);
  const auto service = node->create_service<Twice>(
      name,
      [callback = std::move(callback)](std::shared_ptr<rmw_request_id_t> id,
                                       std::shared_ptr<Twice::Request> request) {
        callback(*request, detail::from_rmw(*id));
      },
      ServicesQoS(), group);
  return owned(static_cast<takt::Service<Twice>*>(service->entity().get()), service);
}
void RclcppApi::respond(const ServicePtr& core, takt::RequestId id, int value) {
  const auto service = handle_of<Service<Twice>>(core);
  if (service == nullptr) return Api::respond(core, id, value);
  rmw_request_id_t request = detail::to_rmw(id);
  Twice::Response response{value};
  service->send_response(request, response);
}

Api::ClientPtr RclcppApi::make_client(const NodePtr& core, const std::string& name,
                                      takt::ClientOptions& options, const GroupPtr& group) {
  const auto node = handle_of<Node>(core);
  if (node == nullptr) return Api::make_client(core, name, options, group);
  const auto client = node->create_client<Twice>(name, ServicesQoS(), group);
  // Requests of rclcpp's clients wait for ever.
  options.timeout = takt::Nanoseconds::zero();
  options.without_service = takt::Nanoseconds::max();
  return owned(static_cast<takt::Client<Twice>*>(client->entity().get()), client);
}
void RclcppApi::send_request(const ClientPtr& core, int number, Answered callback) {
  const auto client = handle_of<Client<Twice>>(core);
  if (client == nullptr) return Api::send_request(core, number, std::move(callback));
  using Shared = Client<Twice>::SharedFuture;
  const auto request = std::make_shared<Twice::Request>(Twice::Request{number});
  if (++form_ % 2 == 0) {
    answers_.push_back(client
                           ->async_send_request(request,
                                                [callback = std::move(callback)](Shared answer) {
                                                  callback(answer.get().get());
                                                })
                           .future);
    return;
  }
  using WithRequest = Client<Twice>::SharedFutureWithRequest;
  client->async_send_request(request, [callback = std::move(callback)](WithRequest answer) {
    callback(answer.get().second.get());
  });
}
std::unique_ptr<takt::sequences::Asked> RclcppApi::ask(const ClientPtr& core, int number) {
  const auto client = handle_of<Client<Twice>>(core);
  if (client == nullptr) return Api::ask(core, number);
  const auto request = std::make_shared<Twice::Request>(Twice::Request{number});
  answers_.push_back(client->async_send_request(request).share());
  return std::make_unique<AskedRclcpp>(answers_.back());
}

// ---- Parameters ----

void RclcppApi::declare_parameter(const NodePtr& core) {
  const auto node = handle_of<Node>(core);
  if (node == nullptr) return Api::declare_parameter(core);
  rcl_interfaces::msg::ParameterDescriptor descriptor;
  descriptor.integer_range.resize(1);
  descriptor.integer_range[0].to_value = 100;
  node->declare_parameter(kParameter, 0, descriptor);
}
std::shared_ptr<const void> RclcppApi::add_on_set(const NodePtr& core,
                                                  std::function<bool(std::int64_t)> allows) {
  const auto node = handle_of<Node>(core);
  if (node == nullptr) return Api::add_on_set(core, std::move(allows));
  return node->add_on_set_parameters_callback(
      [allows = std::move(allows)](const std::vector<Parameter>& parameters) {
        return rcl_interfaces::msg::SetParametersResult().set__successful(
            allows(parameters.at(0).as_int()));
      });
}
bool RclcppApi::set_parameter(const NodePtr& core, std::int64_t value) {
  const auto node = handle_of<Node>(core);
  if (node == nullptr) return Api::set_parameter(core, value);
  return spoken([&] { return node->set_parameter(Parameter(kParameter, value)).successful; });
}
std::int64_t RclcppApi::get_parameter(const NodePtr& core) {
  const auto node = handle_of<Node>(core);
  return node != nullptr ? node->get_parameter(kParameter).as_int() : Api::get_parameter(core);
}

const char* RclcppApi::call_own(std::uint8_t what, const std::function<std::uint8_t()>& next) {
  switch (what % 7) {
    case 0:
      return shut_down(next);
    case 1:
      return spin_a_node(context_, next);
    case 2:
      return prune_requests(context_, next);
    case 3:
      return change_a_wait_set(context_, next);
    case 4:
      return switch_a_clock(context_, next);
    case 5:
      return make_timers(context_, next);
    default:
      return remove_parameter_callbacks(context_, next);
  }
}

std::string RclcppApi::left_behind() const {
  const bool all_are_ready = std::all_of(answers_.begin(), answers_.end(), [](const auto& answer) {
    return answer.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  });
  return all_are_ready ? "" : "a future of a client that has gone is not ready";
}

}  // namespace rclcpp
