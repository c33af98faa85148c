// Services, over Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__SERVICE_HPP_
#define RCLCPP__SERVICE_HPP_

#include <algorithm>
#include <atomic>
#include <concepts>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "takt/base/lockfree/cells.hpp"
#include "takt/entities/service.hpp"

#include "rclcpp/detail/refused.hpp"
#include "rclcpp/detail/service_introspection.hpp"
#include "rclcpp/macros.hpp"
#include "rclcpp/node_interfaces/node_base_interface.hpp"
#include "rclcpp/qos.hpp"

namespace rclcpp {

namespace detail {
inline rmw_request_id_t to_rmw(takt::RequestId id) {
  rmw_request_id_t request{};
  std::memcpy(request.writer_guid, &id.client, sizeof id.client);
  request.sequence_number = id.sequence;
  return request;
}
inline takt::RequestId from_rmw(const rmw_request_id_t& request) {
  takt::RequestId id;
  std::memcpy(&id.client, request.writer_guid, sizeof id.client);
  id.sequence = request.sequence_number;
  return id;
}
}  // namespace detail

/// Thread safety: every method from any thread. Real-time: as takt::Service. For up to 16 requests
/// at a time, requests, headers and responses come from a pool; their strings and sequences come
/// from the heap.
class ServiceBase : public detail::ServiceIntrospection {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(ServiceBase)
  virtual ~ServiceBase() = default;
  ServiceBase(const ServiceBase&) = delete;
  ServiceBase& operator=(const ServiceBase&) = delete;

  const char* get_service_name() { return name_.c_str(); }
  RCLCPP_REFUSED_(get_service_handle, "rcl's handles")
  RCLCPP_REFUSED_(set_on_new_request_callback, "callbacks for what is new")
  RCLCPP_REFUSED_(clear_on_new_request_callback, "callbacks for what is new")
  // For this library.
  const std::shared_ptr<takt::SubscriptionBase>& entity() const { return takt_; }

 protected:
  explicit ServiceBase(std::string name) : name_(std::move(name)) {}

  std::shared_ptr<takt::SubscriptionBase> takt_;

 private:
  const std::string name_;
};

template <class S>
class Service : public ServiceBase, public std::enable_shared_from_this<Service<S>> {
  using Request = typename S::Request;
  using Response = typename S::Response;
  using Header = std::shared_ptr<rmw_request_id_t>;
  using RequestPtr = std::shared_ptr<Request>;
  using ResponsePtr = std::shared_ptr<Response>;
  using Self = std::shared_ptr<Service>;

 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(Service)

  template <class F>
  static SharedPtr make(node_interfaces::NodeBaseInterface& node, const std::string& name,
                        F callback, const QoS& qos, std::shared_ptr<CallbackGroup> group) {
    const std::string path = node.resolve_topic_or_service_name(name, true);
    auto service = std::make_shared<Service>(path);
    service->template start<F>(*node.takt_node(), path, std::move(callback), qos, std::move(group));
    return service;
  }
  explicit Service(std::string path) : ServiceBase(std::move(path)) {}

  void send_response(rmw_request_id_t& id, Response& response) {
    typed()->send_response(detail::from_rmw(id), response);
  }

 private:
  takt::Service<S>* typed() const { return static_cast<takt::Service<S>*>(takt_.get()); }

  template <class F>
  void start(takt::Node& node, const std::string& path, F callback, const QoS& qos,
             std::shared_ptr<CallbackGroup> group) {
    // std::bind ignores surplus arguments, so forms with few arguments are tried first.
    constexpr bool kSimple = std::invocable<F&, RequestPtr, ResponsePtr>;
    constexpr bool kDeferred = !kSimple && std::invocable<F&, Header, RequestPtr>;
    constexpr bool kWithHeader =
        !kSimple && !kDeferred && std::invocable<F&, Header, RequestPtr, ResponsePtr>;
    constexpr bool kWithSelf =
        !kSimple && !kDeferred && !kWithHeader && std::invocable<F&, Self, Header, RequestPtr>;
    static_assert(kSimple || kDeferred || kWithHeader || kWithSelf ||
                      std::invocable<F&, Self, Header, RequestPtr, ResponsePtr>,
                  "a service cannot call this: see docs/reference/rclcpp.md for the forms "
                  "that it can have");
    auto serve = [weak = this->weak_from_this(), callback = std::move(callback)](
                     const Request& asked, takt::RequestId id) mutable {
      const auto self = weak.lock();
      if (self == nullptr) return;  // the service is being dropped
      // Waits for start() to set takt_; start() runs no user code meanwhile.
      self->is_made_.wait(false);
      if (self->takt_ == nullptr) return;  // an executor has refused the service
      const auto cells = self->cells_.allocator();
      auto request = std::allocate_shared<Request>(cells, asked);
      const auto header = [&] {
        return std::allocate_shared<rmw_request_id_t>(cells, detail::to_rmw(id));
      };
      if constexpr (kDeferred) {
        callback(header(), std::move(request));
      } else if constexpr (kWithSelf) {
        callback(self, header(), std::move(request));
      } else {
        auto response = std::allocate_shared<Response>(cells);
        if constexpr (kSimple) {
          callback(std::move(request), response);
        } else if constexpr (kWithHeader) {
          callback(header(), std::move(request), response);
        } else {
          callback(self, header(), std::move(request), response);
        }
        self->typed()->send_response(id, *response);
      }
    };
    const struct Made {  // also if create_service throws: a callback waits for it
      std::atomic<bool>& is_made;
      ~Made() {
        is_made.store(true);
        is_made.notify_all();
      }
    } made{is_made_};
    takt_ = node.create_service<S>(path, std::move(serve), std::move(group),
                                   {.depth = qos.to_takt(true).depth, .loans = 0});
  }

  // Limit: requests that lie in cells with their headers and responses. At it: further ones come
  // from the heap. Seen: `takt run --allocations`.
  static constexpr std::size_t kMostInCells = 16;
  const takt::Cells cells_{
      3 * kMostInCells,
      std::max({sizeof(Request), sizeof(Response), sizeof(rmw_request_id_t)}) + 64};
  // A request may arrive before start() has set takt_.
  std::atomic<bool> is_made_{false};
};

}  // namespace rclcpp

#endif  // RCLCPP__SERVICE_HPP_
