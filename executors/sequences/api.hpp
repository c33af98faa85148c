// The API that a program of bytes calls: Takt's own, or one above it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SEQUENCES_API_HPP_
#define TAKT_EXECUTORS_SEQUENCES_API_HPP_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "takt/executors/executor.hpp"
#include "takt/executors/sequences/sequence_types.hpp"
#include "takt/nodes/node.hpp"

namespace takt::sequences {

inline constexpr const char* kParameter = "even";  // of each node, from 0 to 100

/// A call whose answer comes to a future.
class Asked {
 public:
  virtual ~Asked() = default;
  virtual FutureReturnCode spin(Executor& executor, Nanoseconds limit) = 0;
  virtual bool is_ready() const = 0;
  /// Only when it is ready. nullptr: the call has ended without an answer.
  virtual const Twice::Response* answer() = 0;
};

/// Takt's own API. Another API overrides the methods that it has. What they make are objects of
/// Takt, so that the model can inspect them; the last pointer to one owns the handle of the other
/// API.
class Api {
 public:
  using NodePtr = std::shared_ptr<Node>;
  using GroupPtr = std::shared_ptr<CallbackGroup>;
  using ClientPtr = std::shared_ptr<Client<Twice>>;
  using ServicePtr = std::shared_ptr<Service<Twice>>;
  using Serve = std::function<void(const Twice::Request&, Twice::Response&)>;
  using ServeLater = std::function<void(const Twice::Request&, RequestId)>;
  using Answered = std::function<void(const Twice::Response*)>;

  virtual ~Api() = default;

  virtual std::vector<std::string> executor_names() const;
  virtual std::unique_ptr<Executor> make_executor(const std::string& type,
                                                  const ExecutorOptions& options);
  /// The clock by which spin_until_future_complete measures its limit, on an executor with this
  /// clock.
  virtual const Clock& clock_of_limits(const Clock& clock) const { return clock; }

  virtual NodePtr make_node(const std::string& name, const NodeOptions& options);
  virtual GroupPtr make_group(const NodePtr& node, const std::string& name, CallbackGroupType type);
  virtual std::shared_ptr<Timer> make_timer(const NodePtr& node, const std::string& name,
                                            Nanoseconds period, std::function<void()> callback,
                                            const GroupPtr& group);
  virtual std::shared_ptr<SubscriptionBase> make_subscription(const NodePtr& node,
                                                              const std::string& topic,
                                                              std::size_t depth,
                                                              std::function<void()> callback,
                                                              const GroupPtr& group);
  /// Publishes on the topic of this publisher.
  virtual std::function<void()> make_publish(const NodePtr& node,
                                             std::shared_ptr<Publisher<Number>> publisher);

  virtual ServicePtr make_service(const NodePtr& node, const std::string& name, Serve callback,
                                  const GroupPtr& group);
  virtual ServicePtr make_service(const NodePtr& node, const std::string& name, ServeLater callback,
                                  const GroupPtr& group);
  virtual void respond(const ServicePtr& service, RequestId id, int value);
  /// Sets `options` to those that the client has in this API.
  virtual ClientPtr make_client(const NodePtr& node, const std::string& name,
                                ClientOptions& options, const GroupPtr& group);
  virtual void send_request(const ClientPtr& client, int number, Answered callback);
  virtual std::unique_ptr<Asked> ask(const ClientPtr& client, int number);

  // The parameter kParameter. Its own callbacks must not set it: Error.
  virtual void declare_parameter(const NodePtr& node);
  virtual std::shared_ptr<const void> add_on_set(const NodePtr& node,
                                                 std::function<bool(std::int64_t)> allows);
  virtual bool set_parameter(const NodePtr& node, std::int64_t value);
  virtual std::int64_t get_parameter(const NodePtr& node);

  /// A call that only this API has, with its own model; `next` gives its arguments. Returns the
  /// promise that was broken; nullptr: none was.
  virtual const char* call_own(std::uint8_t, const std::function<std::uint8_t()>&) {
    return nullptr;
  }

  /// Names what has outlived the program; empty: nothing has.
  virtual std::string left_behind() const { return {}; }
};

}  // namespace takt::sequences

#endif  // TAKT_EXECUTORS_SEQUENCES_API_HPP_
