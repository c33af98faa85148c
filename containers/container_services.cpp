// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/container_services.hpp"

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"

namespace takt {
namespace {

constexpr const char* kRequestThreads = "requests";
// Limit: requests to a container that run code of components at the same time. At it: further
// requests wait. Seen: nothing.
constexpr std::size_t kMostRequests = 3;  // that run code of users at the same time

}  // namespace

ContainerServices::~ContainerServices() {
  setting_.modes->set_waker(nullptr);
  // Executors and users may hold nodes, and so their time source.
  if (setting_.time_source != nullptr) setting_.time_source->set_host(nullptr);
}

// Requests to a program come through a hidden node, which is not one of the program's own; one
// thread serves them.
void ContainerServices::make(Container& container) {
  const bool is_program = setting_.is_seen_program();
  NodeOptions options{.clock = setting_.overrides.clock, .time_source = setting_.time_source};
  options.participant = is_program ? setting_.overrides.participant : setting_.participant;
  node_ = std::make_shared<Node>((is_program ? "_" : "") + setting_.own_name(""), options);
  if (is_program) {
    manager_ =
        std::make_unique<ComponentManager>(container, node_, executors_.make_own(kServiceThread));
  } else {
    const bool tells_all = setting_.participant != nullptr && !setting_.description.is_split_off;
    manager_ = std::make_unique<ComponentManager>(
        container, node_, executors_.make_own(kRequestThreads, kMostRequests),
        load_policy(setting_.description),
        tells_all && setting_.description.dds->parameter_services);
    if (tells_all && setting_.description.dds->rosout) rosout_ = std::make_unique<Rosout>(*node_);
    if (tells_all && setting_.description.dds->diagnostics)
      diagnostics_ =
          std::make_unique<Diagnostics>(container, *node_, manager_->make_group("diagnostics"));
    executors_.make_own(kServiceThread).add_node(node_);
  }
  mode_wanted_ = node_->create_guard_condition(
      "mode_wanted", [this] { switch_mode(); }, manager_->make_group("mode"));
  setting_.modes->set_waker(mode_wanted_.get());
  failed_ = node_->create_guard_condition(
      "failed", [this] { displace_failed(); }, manager_->make_group("failed"));
  setting_.time_source->set_host(node_);
  if (lifecycle_.node() != nullptr) of_lifecycle_node_ = manager_->serve(lifecycle_.node());
}

void ContainerServices::serve(Loaded& loaded) {
  const bool serves_itself = loaded.description.type.empty();  // as nodes of programs do
  if (manager_ != nullptr && !serves_itself) loaded.services = manager_->serve(loaded.node());
}

bool ContainerServices::handle(const FailedCallback& failed) {
  const auto is_own = [&](const std::shared_ptr<Node>& node) {
    return node != nullptr && failed.node == node->fully_qualified_name();
  };
  OnException policy = OnException::terminate;
  std::string_view node = failed.node, callback = failed.callback;
  if (is_own(node_) || is_own(lifecycle_.node())) {
    policy = OnException::ignore;
    if (callback.starts_with('/')) {  // a service of a component, named after it
      const std::size_t slash = callback.rfind('/');
      node = callback.substr(0, slash);
      callback.remove_prefix(slash + 1);
    }
  }
  policy = components_.fails(node).value_or(policy);
  log(LogLevel::error, "{}{}{} threw: {}; {}", node, callback.starts_with('/') ? "" : "/", callback,
      text_of(failed.exception),
      policy == OnException::terminate     ? "the container stops"
      : policy == OnException::remove_node ? "its node is removed from its executors"
                                           : "ignored");
  if (policy == OnException::remove_node) failed_->trigger();
  return policy != OnException::terminate;
}

// Not called on the thread of the failed callback: two callbacks of one node that fail at the same
// time would wait for each other.
void ContainerServices::displace_failed() {
  for (const auto& loaded : components_.take_failed()) {
    try {
      executors_.displace(*loaded);
    } catch (const Error& error) {
      log(LogLevel::error, "{} stays: {}", loaded->node()->fully_qualified_name(), error.what());
    } catch (...) {
      log(LogLevel::error, "{} stays: its scheduler threw", loaded->node()->fully_qualified_name());
    }
  }
}

void ContainerServices::switch_mode() {
  setting_.modes->follow(*setting_.overrides.clock, [this](std::size_t mode) {
    for (const auto& loaded : components_.all()) setting_.modes->serve_as_in(mode, loaded->node());
    watch_.changed("the mode has changed");
  });
}

}  // namespace takt
