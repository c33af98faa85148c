// Bands of priorities: each thread takes the callbacks from its band upwards, so that a thread of
// higher priority is free when an urgent callback comes.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"
using namespace takt;

class Bands final : public WorkersPolicy {
 public:
  explicit Bands(const ExecutorOptions& options) {
    const OwnValue* bands = find(options.own, "bands");
    if (bands == nullptr) return;
    for (const OwnValue& least : bands->as_list())
      least_.push_back(static_cast<int>(least.as_integer(-1'000'000, 1'000'000)));
    if (least_.size() != options.threads.size())
      bands->refuse("it is not a list of one priority for each thread");
  }
  WorkerSet workers_of(const NamedCallback& callback,
                       std::span<const ThreadAttributes> workers) const override {
    WorkerSet set = 0;
    for (std::size_t i = 0; i < workers.size(); ++i) {
      if (least_.empty() || callback.info.priority >= least_[i]) set |= WorkerSet{1} << i;
    }
    return set;
  }

 private:
  std::vector<int> least_;  // the least priority of a callback that each thread takes
};
TAKT_REGISTER_EXECUTOR("bands", "urgent callbacks on threads of their own",
                       .readiness = Readiness::events, .scheduler = "fixed_priority",
                       .max_threads = 64, .pool = true, .workers = make_workers_policy<Bands>,
                       .keys = {{"bands", "the least priority that each thread takes: [10, 0]"}})
