// Manual composition: an ordinary main over the same classes, which are linked into it. See
// pipeline.yaml for the same three in a process each.
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <thread>

#include "takt/containers/component.hpp"
#include "takt/executors/executor.hpp"

int main(int argc, char** argv) try {
  const std::string name = argc > 1 ? argv[1] : "single_threaded";
  const auto executor = takt::executors().make(name, {.name = name});
  std::vector<std::unique_ptr<takt::Component>> components;
  for (const char* type : {"pipeline::Sink", "pipeline::Filter", "pipeline::Source"}) {
    components.push_back(takt::components().make(type, {}));
    executor->add_node(components.back()->node);
  }
  const std::jthread stop([&] {
    std::this_thread::sleep_for(std::chrono::seconds(1));
    executor->cancel();
  });
  executor->spin();
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
} catch (...) {
  std::fprintf(stderr, "a callback threw an object that is not a std::exception\n");
  return 1;
}
