// Converts the callback signatures of rclcpp's subscriptions into those of Takt.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__DETAIL__SUBSCRIPTION_CALLBACK_HPP_
#define RCLCPP__DETAIL__SUBSCRIPTION_CALLBACK_HPP_

#include <concepts>
#include <memory>
#include <utility>

#include "rclcpp/message_info.hpp"
#include "rclcpp/serialized_message.hpp"
#include "rclcpp/type_adapter.hpp"

namespace rclcpp::detail {

/// Whether F takes an Argument, alone or with the MessageInfo.
template <class F, class Argument>
inline constexpr bool kTakes =
    std::invocable<F&, Argument> || std::invocable<F&, Argument, const MessageInfo&>;

// The order of these checks matters. A callback for `const M&` needs no conversion, and a callback
// for a shared_ptr (const or not) also accepts a unique_ptr. std::bind ignores surplus arguments,
// so the form without MessageInfo comes first.
template <class F, class M>
inline constexpr bool kLooks = kTakes<F, const M&>;
template <class F, class M>
inline constexpr bool kShares = !kLooks<F, M> && kTakes<F, std::shared_ptr<const M>>;
template <class F, class M>
inline constexpr bool kChanges = !kLooks<F, M> && !kShares<F, M> && kTakes<F, std::shared_ptr<M>>;
template <class F, class M>
inline constexpr bool kOwns =
    !kLooks<F, M> && !kShares<F, M> && !kChanges<F, M> && kTakes<F, std::unique_ptr<M>>;
template <class F, class M>
inline constexpr bool kHasForm = kLooks<F, M> || kShares<F, M> || kChanges<F, M> || kOwns<F, M>;
template <class F>
inline constexpr bool kTakesBytes =
    kTakes<F, std::shared_ptr<SerializedMessage>> ||
    kTakes<F, std::shared_ptr<const SerializedMessage>> || kTakes<F, const SerializedMessage&> ||
    kTakes<F, std::unique_ptr<SerializedMessage>>;

template <class F, class Argument>
void call(F& callback, Argument&& argument, const takt::MessageInfo& info) {
  if constexpr (requires { callback.received(info); }) callback.received(info);  // topic statistics
  if constexpr (std::invocable<F&, Argument>) {
    callback(std::forward<Argument>(argument));
  } else {
    callback(std::forward<Argument>(argument), MessageInfo(info));
  }
}

/// Takt's callback for messages of type M.
template <class M, class F>
auto takt_callback(F callback) {
  if constexpr (kLooks<F, M>) {
    return
        [callback = std::move(callback)](const M& message, const takt::MessageInfo& info) mutable {
          call<F, const M&>(callback, message, info);
        };
  } else if constexpr (kShares<F, M>) {
    return [callback = std::move(callback)](std::shared_ptr<const M> message,
                                            const takt::MessageInfo& info) mutable {
      call<F, std::shared_ptr<const M>>(callback, std::move(message), info);
    };
  } else if constexpr (kChanges<F, M>) {
    return [callback = std::move(callback)](std::shared_ptr<M> message,
                                            const takt::MessageInfo& info) mutable {
      call<F, std::shared_ptr<M>>(callback, std::move(message), info);
    };
  } else {
    static_assert(kOwns<F, M>,
                  "a subscription cannot call this: see docs/reference/rclcpp.md for the "
                  "forms that it can have");
    return [callback = std::move(callback)](std::unique_ptr<M> message,
                                            const takt::MessageInfo& info) mutable {
      call<F, std::unique_ptr<M>>(callback, std::move(message), info);
    };
  }
}

/// Takt's callback for a TypeAdapter: converts the message if F takes the custom type.
template <class Types, class F>
auto adapted_callback(F callback) {
  using Custom = typename Types::Custom;
  using Ros = typename Types::Ros;
  if constexpr (Types::kIsAdapted && kHasForm<F, Custom>) {
    return [inner = takt_callback<Custom>(std::move(callback))](
               const Ros& message, const takt::MessageInfo& info) mutable {
      auto custom = std::make_unique<Custom>();
      Types::Adapter::convert_to_custom(message, *custom);
      if constexpr (kLooks<F, Custom>) {
        inner(*custom, info);
      } else {
        inner(std::move(custom), info);
      }
    };
  } else {
    return takt_callback<Ros>(std::move(callback));
  }
}

}  // namespace rclcpp::detail

#endif  // RCLCPP__DETAIL__SUBSCRIPTION_CALLBACK_HPP_
