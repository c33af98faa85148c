// Long work in batches: while it plans for 200 ms, the same thread controls each 5 ms.
//   takt run examples/21_batches/planner.yaml
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"

namespace demo {

using namespace std::chrono_literals;

class Planner : public takt::Node {
 public:
  explicit Planner(const takt::NodeOptions& options) : Node("planner", options) {
    const auto per_batch = declare_parameter<int>("cells_per_batch", 100);
    const auto planning =
        create_callback_group("planning", takt::CallbackGroupType::MutuallyExclusive);
    plan_ = create_timer(
        "plan", 500ms,
        [per_batch]() -> takt::Task<> {
          for (int cell = 1; cell <= 20'000; ++cell) {
            takt::burn_cpu(10us);
            if (cell % per_batch == 0) co_await takt::batch();
          }
        },
        planning);
    control_ = create_timer("control", 5ms, [] {});
  }

 private:
  takt::Timer::SharedPtr plan_, control_;
};

}  // namespace demo

TAKT_REGISTER_COMPONENT(demo::Planner, "plans in batches, and controls between them")
