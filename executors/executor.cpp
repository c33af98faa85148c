// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"

namespace takt {

ExecutorRegistry& executors() {
  static ExecutorRegistry registry("executor");
  return registry;
}

}  // namespace takt
