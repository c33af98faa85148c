// A program of none.cpp alone, without the library, as a build with TAKT_SHARED_MEMORY=OFF has it.
// If none.cpp lacks a function of iceoryx.hpp or shared_memory.hpp, it does not link.
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "takt/base/error.hpp"
#include "takt/transport/shared_memory/iceoryx.hpp"

namespace {

struct Reader final : takt::SharedReader {
  void refused() noexcept override {}
  std::string_view topic() const noexcept override { return "/scan"; }
};

bool refuses_to_start() {
  try {
    const takt::RoudiProcess process(std::vector<takt::ChunkPool>{});
    return false;
  } catch (const takt::Error&) {
    return !takt::RoudiProcess::is_installed();
  }
}

bool has_no_chunks() {
  takt::MessageType type;
  ddsi_sertype sertype{};
  ddsi_serdata data{};
  takt::set_chunk_size(sertype, 8);
  takt::put_chunk(data, nullptr, nullptr);
  takt::with_chunks({}, nullptr);
  return takt::chunk_of(data, type) == nullptr && !takt::free_chunk(data) &&
         takt::chunks_of_reader(5, 8) == 5 && takt::shared_queue_depth(5, 8) == 5 &&
         takt::shared_messages_held(5) == 0 &&
         !takt::why_no_chunk(type, takt::find_roudi(), true).empty();
}

}  // namespace

int main() {
  const takt::Roudi roudi = takt::find_roudi();
  Reader reader;
  reader.register_reader();
  const bool counts_none = takt::shared_reader_count() == 0 && !takt::count_refused("");
  reader.unregister_reader();
  takt::bound_exit();
  takt::delete_within_bound(0);
  const bool is_off = takt::shared_memory_settings(0, "") == "<Enable>false</Enable>";
  const bool holds = takt::why_not(roudi) == "this Takt was built without shared memory" &&
                     refuses_to_start() && has_no_chunks() && counts_none && is_off;
  std::puts(holds ? "without shared memory, messages go by UDP" : "FAILED");
  return holds ? 0 : 1;
}
