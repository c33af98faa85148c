// Which message of each writer a reader has had last, by shared memory.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_WRITER_SEQUENCES_HPP_
#define TAKT_TRANSPORT_DDS_WRITER_SEQUENCES_HPP_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/transport/shared_memory/iceoryx.hpp"

namespace TAKT_INTERNAL takt {

/// iceoryx overwrites the oldest in a reader's queue when that is late, and does not report it; nor
/// does it of what is sent before RouDi has joined the reader to a writer that it knows already.
/// Thread safety: one thread at a time.
/// Real-time: allocates for a writer that is new.
class WriterSequences {
 public:
  /// How many messages of the writer were overwritten before this one. `handle` is the writer's in
  /// DDS. When it is new, those are forgotten of which `is_matched(handle)` is false.
  template <class IsMatched>
  std::uint64_t overwritten(const ChunkHeader& chunk, std::uint64_t handle,
                            IsMatched&& is_matched) {
    const auto known = std::find_if(last_.begin(), last_.end(),
                                    [&](const Last& last) { return last.writer == chunk.writer; });
    std::uint64_t before = chunk.before;
    if (known != last_.end()) {
      before = std::exchange(known->sequence, chunk.sequence);
    } else {
      std::erase_if(last_, [&](const Last& last) { return !is_matched(last.handle); });
      last_.push_back({chunk.writer, chunk.sequence, handle});
    }
    return chunk.sequence > before ? chunk.sequence - before - 1 : 0;
  }
  std::size_t writers() const noexcept { return last_.size(); }

 private:
  struct Last {
    std::uint64_t writer, sequence, handle;
  };
  std::vector<Last> last_;
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_WRITER_SEQUENCES_HPP_
