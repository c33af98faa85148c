// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"

namespace takt {

template class Registry<Executor, ExecutorTraits, const ExecutorOptions&>;

ExecutorRegistry& executors() {
  static ExecutorRegistry registry("executor");
  return registry;
}

}  // namespace takt
