// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/message_block.hpp"

namespace takt {

void OwnedBlock::recycle() noexcept {
  unique_.reset();
  shared_.reset();
  if (from_heap) {
    delete this;
  } else {
    Pool<OwnedBlock>::recycle(*this);
  }
}

}  // namespace takt
