// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/chain_limits.hpp"

#include <map>
#include <utility>

namespace takt {
namespace {

/// Holds a callback while its chain runs as many callbacks as its limit allows.
class ChainLimits final : public Rule {
 public:
  /// The address of the callback's chain, if that has a limit; else 0.
  std::uint64_t label(const NamedCallback& callback) const override {
    if (callback.info.chain_concurrency == 0) return 0;
    auto& limited = chains_[callback.info.chain];
    if (limited == nullptr) limited.reset(new Limited{callback.info.chain_concurrency});
    return reinterpret_cast<std::uintptr_t>(limited.get());
  }
  bool look(TimePoint, const ReadyCallbacks&) noexcept override {
    return std::exchange(has_room_, false);
  }
  bool admits(const ReadyCallback&, std::uint64_t label) const noexcept override {
    const Limited* const chain = chain_of(label);
    return chain == nullptr || chain->running < chain->most;
  }
  void begins(const ReadyCallback&, std::uint64_t label) noexcept override {
    if (Limited* const chain = chain_of(label)) ++chain->running;
  }
  void done(const ReadyCallback&, std::uint64_t label, Nanoseconds) noexcept override {
    Limited* const chain = chain_of(label);
    if (chain != nullptr && chain->running-- == chain->most) has_room_ = true;
  }

 private:
  struct Limited {
    const std::uint32_t most;
    std::uint32_t running = 0;
  };
  static Limited* chain_of(std::uint64_t label) noexcept {
    return reinterpret_cast<Limited*>(static_cast<std::uintptr_t>(label));
  }

  // Only control threads read the map; workers have the addresses of its values.
  mutable std::map<ChainId, std::unique_ptr<Limited>> chains_;
  bool has_room_ = false;
};

}  // namespace

std::unique_ptr<Rule> make_chain_limits() {
  return std::make_unique<ChainLimits>();
}

}  // namespace takt
