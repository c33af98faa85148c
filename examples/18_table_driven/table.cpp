// A table-driven executor: slots of time that repeat, and which callbacks may start in each.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"
using namespace takt;

class Table final : public Rule {
 public:
  explicit Table(const ExecutorOptions& options) {
    const OwnValue* table = find(options.own, "table");
    if (table == nullptr) return;
    for (const OwnValue& slot : table->as_list()) {
      slot.allow_only({"for", "run"});
      const Nanoseconds length = slot.at("for").as_duration();
      if (length <= Nanoseconds::zero() || length > std::chrono::hours(1))
        slot.at("for").refuse("a slot takes some time, at most an hour");
      frame_ += length;
      slots_.push_back({frame_, {}});
      for (const OwnValue& name : slot.at("run").as_list())
        slots_.back().callbacks.push_back(name.as_text());
    }
    if (slots_.size() > 64) table->refuse("a table has at most 64 slots");
  }
  // Bit i: it may start in slot i. What no slot names may always start.
  std::uint64_t label(const NamedCallback& callback) const override {
    std::uint64_t label = 0;
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      for (const std::string& name : slots_[i].callbacks)
        if (callback.is_called(name)) label |= std::uint64_t{1} << i;
    }
    return label == 0 ? ~label : label;
  }
  void begin(TimePoint now) noexcept override { begin_ = now; }
  bool look(TimePoint now, const ReadyCallbacks&) noexcept override {
    if (slots_.empty() || now < end_) return false;
    const TimePoint frame = now - (now - begin_) % frame_;
    for (slot_ = 0; now >= frame + slots_[slot_].end;) ++slot_;
    end_ = later(frame, slots_[slot_].end);
    return true;
  }
  bool admits(const ReadyCallback&, std::uint64_t label) const noexcept override {
    return (label >> slot_ & 1) != 0;
  }
  TimePoint opens_at() const noexcept override { return slots_.empty() ? kNever : end_; }

 private:
  struct Slot {
    Nanoseconds end;  // since the begin of the frame
    std::vector<std::string> callbacks;
  };
  std::vector<Slot> slots_;
  Nanoseconds frame_{0};
  TimePoint begin_{}, end_{};  // of the first frame, of the present slot
  std::size_t slot_ = 0;
};
TAKT_REGISTER_EXECUTOR("table", "callbacks start in their slots of a table",
                       .readiness = Readiness::events, .scheduler = "fifo",
                       .rule = make_rule<Table>,
                       .keys = {{"table", "slots that repeat: [{for: 5ms, run: [node/callback]}]"}})
