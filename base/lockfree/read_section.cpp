// SPDX-License-Identifier: Apache-2.0
#include "takt/base/lockfree/read_section.hpp"

#include <mutex>
#include <thread>

namespace takt {

[[gnu::tls_model(
    "initial-exec")]] thread_local constinit ReadSection::Reader* ReadSection::this_reader =
    nullptr;

struct ReadSection::Readers {
  std::mutex mutex;         // taken when threads come and go, and to wait for readers
  Reader* first = nullptr;  // records are used again by later threads, never freed
};

ReadSection::Readers& ReadSection::readers() noexcept {
  // Leaked on purpose: threads may end after static objects were destroyed.
  static auto* instance = new Readers;
  return *instance;
}

struct ReadSection::Registration {
  Registration() {
    Readers& all = readers();
    const std::lock_guard lock(all.mutex);
    for (Reader* reader = all.first; reader != nullptr && !mine; reader = reader->next) {
      if (!reader->in_use) mine = reader;
    }
    if (mine == nullptr) {
      mine = new Reader;
      mine->next = all.first;
      all.first = mine;
    }
    mine->in_use = true;
  }
  ~Registration() {
    const std::lock_guard lock(readers().mutex);
    this_reader = nullptr;
    mine->in_use = false;
  }
  Reader* mine = nullptr;
};

ReadSection::Reader& ReadSection::register_thread() noexcept {
  thread_local Registration registration;
  this_reader = registration.mine;
  return *this_reader;
}

void wait_for_readers() noexcept {
  ReadSection::Readers& all = ReadSection::readers();
  const std::lock_guard lock(all.mutex);
  for (ReadSection::Reader* reader = all.first; reader != nullptr; reader = reader->next) {
    const std::uint64_t entered = reader->entered.load();
    if (entered % 2 == 0) continue;
    // A section is shorter than a nap unless its thread was preempted inside it.
    while (reader->entered.load(std::memory_order_acquire) == entered) {
      std::this_thread::sleep_for(std::chrono::microseconds(20));
    }
  }
}

}  // namespace takt
