// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/chain_join.hpp"

#include <algorithm>
#include <atomic>
#include <memory>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/never_destroyed.hpp"

namespace takt {
namespace {

constexpr std::uint64_t kJoined = std::uint64_t{1} << 63;
constexpr std::uint64_t kBeingWritten = UINT64_MAX;

/// The instances that a joined number stands for. A reader compares `number` before and after: if
/// it is the same, no other thread has written meanwhile.
struct Joined {
  struct Instance {
    std::atomic<std::uint64_t> path{0};
    std::atomic<TimePoint> root_release{};
  };
  std::atomic<std::uint64_t> number{0};
  std::atomic<std::uint64_t> path{0};    // of the callback that joined them
  std::atomic<std::uint64_t> before{0};  // the number of its instance before the join
  std::atomic<std::size_t> count{0};
  std::array<Instance, JoiningInstances::kMost> instances;
};
using Table = std::array<Joined, ChainJoin::kMostJoined>;

// Made for the first join, as most programs have none.
std::atomic<Table*> table_of_process{nullptr};

void make_table() {
  static detail::NeverDestroyed<Table> table;
  table_of_process.store(&*table);
}

Joined& place(std::uint64_t number) noexcept {
  return (*table_of_process.load())[number % ChainJoin::kMostJoined];
}

/// The factor by which this number of callbacks changes a path.
std::uint64_t factor(std::uint64_t callbacks) noexcept {
  std::uint64_t result = 1;
  while (callbacks-- != 0) result *= kPathFactor;
  return result;
}

/// Calls use(instance) for all joined instances that continue with the dispatch, with their present
/// paths. False: the table has forgotten the number.
template <class Use>
bool for_each_joined(const Dispatch& dispatch, const Use& use) noexcept {
  if (!is_joined(dispatch.chain_instance)) return true;
  const Joined& joined = place(dispatch.chain_instance);
  if (joined.number.load() != dispatch.chain_instance) return false;
  const std::uint64_t path = joined.path.load();
  JoiningInstances found;
  for (std::size_t i = 0; i < std::min(joined.count.load(), JoiningInstances::kMost); ++i) {
    found.add({joined.instances[i].path.load(), joined.instances[i].root_release.load()});
  }
  if (joined.number.load() != dispatch.chain_instance) return false;
  // All instances have passed the same callbacks since the join.
  const std::uint64_t since = factor((dispatch.path - path) & 0xff);
  for (const JoiningInstances::Instance& instance : found) {
    use(JoiningInstances::Instance{dispatch.path + (instance.path - path) * since,
                                   instance.root_release});
  }
  return true;
}

/// A number for the dispatch and these instances; 0 when another thread writes to the place.
std::uint64_t join(const Dispatch& dispatch, const JoiningInstances& others) noexcept {
  static constinit std::atomic<std::uint64_t> last{0};
  const std::uint64_t number = kJoined | (last.fetch_add(1) + 1);
  Joined& joined = place(number);
  if (joined.number.exchange(kBeingWritten) == kBeingWritten) return 0;
  std::size_t count = 0;
  for (const JoiningInstances::Instance& instance : others) {
    joined.instances[count].path.store(instance.path);
    joined.instances[count++].root_release.store(instance.root_release);
  }
  joined.path.store(dispatch.path);
  joined.before.store(instance_before_joins(dispatch.chain_instance));
  joined.count.store(count);
  joined.number.store(number);
  return number;
}

}  // namespace

bool JoiningInstances::add(const Instance& instance) noexcept {
  if (count_ == kMost) return false;
  instances_[count_++] = instance;
  return true;
}

std::size_t JoiningInstances::add_all_of(const Dispatch& dispatch) noexcept {
  std::size_t left_out = 0;
  const auto add_one = [&](const Instance& instance) { left_out += add(instance) ? 0 : 1; };
  add_one({dispatch.path, dispatch.root_release});
  for_each_joined(dispatch, add_one);
  return left_out;
}

void JoiningInstances::remove(std::uint64_t path) noexcept {
  const auto is_it = [path](const Instance& instance) { return instance.path == path; };
  auto* const last = instances_.data() + count_;
  count_ =
      static_cast<std::size_t>(std::remove_if(instances_.data(), last, is_it) - instances_.data());
}

ChainJoin::ChainJoin(std::size_t inputs) {
  if (inputs == 0 || inputs > JoiningInstances::kMost) {
    throw Error(fmt::format("a join of chains was made with {} inputs", inputs),
                fmt::format("give it 1 to {}", JoiningInstances::kMost));
  }
  inputs_.resize(inputs);
  make_table();
}

void ChainJoin::received(std::size_t input) noexcept {
  const Dispatch* dispatch = Dispatch::current();
  if (dispatch == nullptr || input >= inputs_.size()) return;
  inputs_[input].clear();
  left_out_ += inputs_[input].add_all_of(*dispatch);
}

void ChainJoin::combine() noexcept {
  JoiningInstances all;
  const Dispatch* dispatch = Dispatch::current();
  if (dispatch != nullptr) {
    left_out_ += all.add_all_of(*dispatch);
    all.remove(dispatch->path);  // the message's envelope has this one
  }
  for (JoiningInstances& input : inputs_) {
    for (const JoiningInstances::Instance& instance : input) {
      if (dispatch == nullptr || instance.path == dispatch->path) continue;
      all.remove(instance.path);  // each path only once
      if (!all.add(instance)) ++left_out_;
    }
    input.clear();
  }
  if (all.begin() == all.end()) return;
  if (const std::uint64_t number = join(*dispatch, all)) {
    dispatch->chain_instance = number;
  } else {
    ++left_out_;
  }
}

std::optional<TimePoint> joined_root(const Dispatch& dispatch, std::uint64_t path) noexcept {
  std::optional<TimePoint> root;
  for_each_joined(dispatch, [&](const JoiningInstances::Instance& instance) {
    if (instance.path == path) root = instance.root_release;
  });
  return root;
}

std::uint64_t instance_before_joins(std::uint64_t chain_instance) noexcept {
  if (!is_joined(chain_instance)) return chain_instance;
  const Joined& joined = place(chain_instance);
  const std::uint64_t before = joined.before.load();
  return joined.number.load() == chain_instance ? before : chain_instance;
}

}  // namespace takt
