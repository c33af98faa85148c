// Joins chains in a callback that combines several inputs to one message.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_CHAIN_JOIN_HPP_
#define TAKT_NODES_CHAIN_JOIN_HPP_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"

namespace TAKT_PUBLIC takt {

/// Chain instances that are about to continue as one.
/// Thread safety: none; the owner's lock guards it.
/// Real-time: nothing blocks or allocates; linear in kMost.
class JoiningInstances {
 public:
  /// How many can continue as one; further ones are dropped.
  // Limit: chain instances that a join lets continue as one. At it: further instances end there.
  // Seen: `ChainJoin::left_out`.
  static constexpr std::size_t kMost = 16;
  struct Instance {
    std::uint64_t path = 0;  // so far
    TimePoint root_release{};
  };

  const Instance* begin() const noexcept { return instances_.data(); }
  const Instance* end() const noexcept { return instances_.data() + count_; }
  /// False: there is no room.
  bool add(const Instance& instance) noexcept;
  /// The instance of the dispatch, and those that go on with it since an earlier join. Returns how
  /// many did not fit.
  std::size_t add_all_of(const Dispatch& dispatch) noexcept;
  void remove(std::uint64_t path) noexcept;
  void clear() noexcept { count_ = 0; }

 private:
  std::array<Instance, kMost> instances_;
  std::size_t count_ = 0;
};

/// For a fusion of several inputs: the chains of all inputs continue with the published message.
/// Without it, the message belongs only to the chain of the input in whose callback it is
/// published:
///
///   on left:   join.received(0); left_ = message; fuse();
///   on right:  join.received(1); right_ = message; fuse();
///   fuse:      if (!left_ || !right_) return;
///              join.combine();
///              publisher->publish(…);
///
/// The message contains a number that identifies all joined instances; the process stores the
/// newest kMostJoined numbers. With an older number, only the chain of the last input is measured.
/// Thread safety: calls are serialised by the user, as a mutually exclusive group of the callbacks
/// does.
/// Real-time: received() and combine() neither block nor allocate.
class ChainJoin {
 public:
  // Limit: joined instances that a process remembers. At it: of older ones only the chain of the
  // last input is measured. Seen: in a simulation, a note.
  static constexpr std::size_t kMostJoined = 1024;

  /// Throws Error when there are no inputs, or more than JoiningInstances::kMost.
  explicit ChainJoin(std::size_t inputs);

  /// The running callback was called for this input, from 0. Of several messages of one input, the
  /// last one counts.
  void received(std::size_t input) noexcept;
  /// From here on, what the running callback publishes belongs to its own chain instance and to
  /// those of the inputs received since the last combine().
  void combine() noexcept;
  /// Instances that ended here because more than JoiningInstances::kMost would have continued.
  std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  std::vector<JoiningInstances> inputs_;
  std::uint64_t left_out_ = 0;
};

// For executors.

/// Whether the number stands for several instances.
constexpr bool is_joined(std::uint64_t chain_instance) noexcept {
  return static_cast<std::int64_t>(chain_instance) < 0;
}
/// The release of the root of the instance that has come to the dispatch on this path, when it is
/// one of those that were joined.
std::optional<TimePoint> joined_root(const Dispatch& dispatch, std::uint64_t path) noexcept;
/// The same of any instance.
inline std::optional<TimePoint> root_release(const Dispatch& dispatch,
                                             std::uint64_t path) noexcept {
  if (dispatch.path == path) return dispatch.root_release;
  if (!is_joined(dispatch.chain_instance)) return std::nullopt;
  return joined_root(dispatch, path);
}
/// The number that the instance of the input that came last had before it was joined.
std::uint64_t instance_before_joins(std::uint64_t chain_instance) noexcept;

}  // namespace takt

#endif  // TAKT_NODES_CHAIN_JOIN_HPP_
