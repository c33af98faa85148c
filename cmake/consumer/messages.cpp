// Messages from the project's own interface files.
// SPDX-License-Identifier: Apache-2.0
#include "tanks/tank.hpp"

int main() {
  const takt::MessageType& type = takt::message_type<tank::Tank>();
  tank::Tank tank;
  tank.level.values = {1, 2};
  takt::ByteBuffer bytes;
  type.encode(&tank, bytes);
  tank::Tank back;
  return type.decode(bytes.bytes(), &back) && back == tank && back.level.unit.name == "m" ? 0 : 1;
}
