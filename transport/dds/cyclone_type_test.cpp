// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/cyclone_type.hpp"

#include <gtest/gtest.h>

#include "takt/messages/rcl_interfaces/srv/set_parameters.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"

namespace takt {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;

// How many of so many bytes a type lets in, of `most` that come.
template <class Message>
std::size_t let_in(std::size_t bytes, std::size_t most) {
  auto* const type = new Sertype(message_type<Message>(), false);
  std::vector<Serdata> messages(most);
  std::size_t count = 0;
  for (Serdata& message : messages) {
    if (!type->let_in(message, bytes)) break;
    ++count;
  }
  for (std::size_t i = count; i < most; ++i) {
    EXPECT_FALSE(type->let_in(messages[i], bytes)) << "the newest are dropped, not those in queues";
  }
  for (Serdata& message : messages) type->leave(message);
  Serdata once_more;
  EXPECT_TRUE(count == 0 || type->let_in(once_more, bytes)) << "what has left counts no more";
  ddsi_sertype_unref(type);
  return count;
}

// 1,000 announcements of 10 MB each were kept: a depth counts messages, not bytes.
TEST(CycloneType, LetsNoMoreBytesInThanItsLimit) {
  EXPECT_EQ(let_in<std_msgs::msg::String>(64 * kMiB, 20), 16U);
  EXPECT_EQ(let_in<std_msgs::msg::String>(2048 * kMiB, 20), 1U) << "the only one may be large";
  using Request = rcl_interfaces::srv::SetParameters::Request;
  EXPECT_EQ(let_in<Request>(16 * kMiB, 10), 4U);
  EXPECT_EQ(let_in<Request>(65 * kMiB, 10), 0U);
}

}  // namespace
}  // namespace takt
