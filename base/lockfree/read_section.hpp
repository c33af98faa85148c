// Lets threads use a shared table without a lock while another thread replaces it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LOCKFREE_READ_SECTION_HPP_
#define TAKT_BASE_LOCKFREE_READ_SECTION_HPP_

#include <atomic>
#include <cstdint>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// While an object of this class lives, nothing that the thread reached through an atomic pointer
/// *after* constructing it is freed by a thread that calls `wait_for_readers()` first.
///
/// The protocol (read-copy-update with one flag for each thread):
/// 1. A reader raises its flag (sequentially consistent exchange), loads the pointer, uses it,
///    and lowers the flag. Sections nest; only the outermost touches the flag.
/// 2. A writer replaces the pointer (sequentially consistent), then waits until each flag that it
///    sees raised has been lowered once. A reader that raises its flag later sees the new pointer.
///
/// Sections must be short and must never contain a user's code.
/// Thread safety: an object belongs to the thread that made it.
/// Real-time: wait-free, about 3 ns; but a thread's first section registers the thread, which
/// allocates. Executor threads do that before their first callback.
class ReadSection {
 public:
  [[gnu::always_inline]] ReadSection() noexcept
      : reader_(this_reader ? *this_reader : register_thread()) {
    if (reader_.depth++ == 0) reader_.entered.exchange(reader_.entered.load() + 1);
  }
  [[gnu::always_inline]] ~ReadSection() {
    if (--reader_.depth == 0) {
      // Release: pairs with the acquire in wait_for_readers; our reads end before it continues.
      reader_.entered.store(reader_.entered.load() + 1, std::memory_order_release);
    }
  }
  ReadSection(const ReadSection&) = delete;
  ReadSection& operator=(const ReadSection&) = delete;

 private:
  friend void wait_for_readers() noexcept;
  struct alignas(64) Reader {
    std::atomic<std::uint64_t> entered{0};  // odd while the thread is inside
    unsigned depth = 0;
    bool in_use = true;
    Reader* next = nullptr;
  };
  struct Registration;
  struct Readers;
  static Readers& readers() noexcept;
  static Reader& register_thread() noexcept;
  [[gnu::tls_model("initial-exec")]] static thread_local constinit Reader* this_reader;

  Reader& reader_;
};

/// Returns when every read section that was open at the call has been closed. For control threads:
/// it sleeps in short naps, and it must not be called inside a read section.
void wait_for_readers() noexcept;

}  // namespace takt

#endif  // TAKT_BASE_LOCKFREE_READ_SECTION_HPP_
