// What iceoryx refuses to give to a reader, which only the log of Cyclone shows.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_SHARED_MEMORY_REFUSED_CHUNKS_HPP_
#define TAKT_TRANSPORT_SHARED_MEMORY_REFUSED_CHUNKS_HPP_

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace takt {

/// A reader by shared memory, known from `register_reader` to `unregister_reader`.
class SharedReader {
 public:
  void register_reader();
  void unregister_reader() noexcept;

 protected:
  SharedReader() = default;
  ~SharedReader() = default;

  /// A message of it is lost. On iceoryx's listener thread, which is also the one that receives.
  virtual void refused() noexcept = 0;
  virtual std::string_view topic() const noexcept = 0;

 private:
  friend bool count_refused(std::string_view) noexcept;
  std::uint64_t refused_ = 0;
};

/// How many readers are registered.
std::size_t shared_reader_count() noexcept;

/// Whether the complaint of Cyclone's says that iceoryx has refused a message, as a reader holds
/// 256 already, or chunks were lost with publishers that were killed. Then it is counted by a
/// reader of that topic, and logged once a second. Several readers of a topic take turns, as the
/// complaint does not name one.
bool count_refused(std::string_view complaint) noexcept;

}  // namespace takt

#endif  // TAKT_TRANSPORT_SHARED_MEMORY_REFUSED_CHUNKS_HPP_
