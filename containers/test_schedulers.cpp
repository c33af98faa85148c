// A library of schedulers, good ones and bad ones, for scheduler_library_test.cpp.
// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "takt/sched/scheduler.hpp"

namespace {

struct LastCome {
  bool operator()(const takt::ReadyCallback& a, const takt::ReadyCallback& b) const noexcept {
    return a.sequence > b.sequence;
  }
};
using Good = takt::HeapScheduler<LastCome>;

struct Forgetful : takt::Scheduler {
  void push(takt::ReadyCallback&) noexcept override {}
  takt::ReadyCallback* pop() noexcept override { return nullptr; }
};

struct NeverMade : Forgetful {
  NeverMade() { throw std::runtime_error("out of order"); }
};

struct NeverConfigured : Forgetful {
  void configure(std::span<const takt::CallbackInfo>) override {
    throw std::runtime_error("out of room");
  }
};

}  // namespace

TAKT_REGISTER_SCHEDULER("good", "last come, first served", Good)
namespace also_good {
TAKT_REGISTER_SCHEDULER("also_good", "the same", Good, .keys = {{"q", "means nothing"}})
}
namespace forgetful {
TAKT_REGISTER_SCHEDULER("forgetful", "for tests", Forgetful)
}
namespace never_made {
TAKT_REGISTER_SCHEDULER("never_made", "for tests", NeverMade)
}
namespace never_configured {
TAKT_REGISTER_SCHEDULER("never_configured", "for tests", NeverConfigured)
}
namespace taken {
TAKT_REGISTER_SCHEDULER("fifo", "for tests", Good)
}
namespace once {
TAKT_REGISTER_SCHEDULER("twice", "for tests", Good)
}
namespace twice {
TAKT_REGISTER_SCHEDULER("twice", "for tests", Good)
}
