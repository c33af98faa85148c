// Small numbers for things that come and go.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_ENGINE_NUMBERS_HPP_
#define TAKT_EXECUTORS_ENGINE_NUMBERS_HPP_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

namespace takt::detail {

/// Dense indices, from 0, for the groups and nodes of an executor. The index of a thing that has
/// gone is reused: schedulers have arrays that are as long as the largest number, and components
/// may be loaded and unloaded for ever. `Alive`: the type of the object that lives as long as its
/// number is in use.
/// Thread safety: none. Real-time: no.
template <class Alive>
class Numbers {
 public:
  struct Known {
    std::uint32_t number;
    std::weak_ptr<Alive> alive;
  };

  /// The caller sets `alive` of one that is new.
  Known& of(const void* thing) {
    const auto [entry, is_new] = known_.try_emplace(thing);
    if (is_new && !free_.empty()) {
      entry->second.number = free_.back();
      free_.pop_back();
    } else if (is_new) {
      entry->second.number = next_++;
    }
    return entry->second;
  }

  void forget_gone() {
    std::erase_if(known_, [this](const auto& entry) {
      if (!entry.second.alive.expired()) return false;
      free_.push_back(entry.second.number);
      return true;
    });
  }

  std::size_t size() const noexcept { return known_.size(); }

 private:
  std::unordered_map<const void*, Known> known_;
  std::vector<std::uint32_t> free_;
  std::uint32_t next_ = 0;
};

}  // namespace takt::detail

#endif  // TAKT_EXECUTORS_ENGINE_NUMBERS_HPP_
