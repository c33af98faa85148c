// Reads the kernel's random numbers through a pipe, under each executor in turn.
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdio>
#include <memory>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/takt.hpp"

int main() {
  for (const std::string& name : takt::executors().names()) {
    const auto executor = takt::executors().make(name, {.name = name});
    const auto node = std::make_shared<takt::Node>("sensor");
    const std::unique_ptr<FILE, int (*)(FILE*)> device(
        popen("for i in 1 2 3; do head -c 16 /dev/urandom; sleep 0.01; done", "r"), pclose);
    std::size_t bytes = 0, reads = 0;

    const auto reader = node->create_file_descriptor(
        "random", fileno(device.get()), takt::FileDescriptorEvents::readable,
        [&](takt::FileDescriptorEvents events) {
          if (contains(events, takt::FileDescriptorEvents::hang_up)) return executor->cancel();
          // What is left is read by the next call.
          std::array<std::byte, 8> buffer;
          bytes +=
              static_cast<std::size_t>(read(fileno(device.get()), buffer.data(), buffer.size()));
          ++reads;
        });

    executor->add_node(node);
    executor->spin();
    fmt::print("{:<22} {} bytes in {} reads\n", name, bytes, reads);
  }
}
