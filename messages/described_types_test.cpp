// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/described_types.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/messages/geometry_msgs/msg/twist_stamped.hpp"
#include "takt/messages/std_msgs/msg/empty.hpp"

namespace takt {
namespace {

namespace wire = type_description_interfaces::msg;
using testing::HasSubstr;
using testing::ThrowsMessage;

wire::Field field(const std::string& name, int id, const std::string& nested = {},
                  std::uint64_t capacity = 0) {
  return wire::Field().set__name(name).set__type(wire::FieldType()
                                                     .set__type_id(static_cast<std::uint8_t>(id))
                                                     .set__capacity(capacity)
                                                     .set__nested_type_name(nested));
}
wire::IndividualTypeDescription type(const std::string& name, std::vector<wire::Field> fields) {
  return wire::IndividualTypeDescription().set__type_name(name).set__fields(std::move(fields));
}
TypeDescription description(std::vector<wire::Field> fields,
                            std::vector<wire::IndividualTypeDescription> others = {}) {
  return TypeDescription()
      .set__type_description(type("p/msg/T", std::move(fields)))
      .set__referenced_type_descriptions(std::move(others));
}
auto refuses(const TypeDescription& description, const std::string& message) {
  EXPECT_THAT([&] { DescribedTypes types(description); }, ThrowsMessage<Error>(HasSubstr(message)));
}

TEST(DescribedTypes, AreThoseThatWereDescribed) {
  const auto& twist = message_type<geometry_msgs::msg::TwistStamped>();
  const DescribedTypes types(describe(twist).value());
  ASSERT_NE(types.find(twist.name), nullptr);
  EXPECT_EQ(type_hash(*types.find(twist.name)), type_hash(twist));
  EXPECT_NE(types.find("geometry_msgs/msg/Vector3"), nullptr);
  EXPECT_EQ(types.find("geometry_msgs/msg/Point"), nullptr);
  const auto& empty = message_type<std_msgs::msg::Empty>();
  const DescribedTypes without_fields(describe(empty).value());
  EXPECT_TRUE(without_fields.find(empty.name)->fields.empty());
  EXPECT_EQ(type_hash(*without_fields.find(empty.name)), type_hash(empty));
}

// Descriptions come from other processes.
TEST(DescribedTypes, RefuseWhatCannotBe) {
  using Shape = FieldShape;
  refuses(description({field("a", 0)}), "does not know the type of the field 'a' of p/msg/T");
  refuses(description({field("a", 12)}), "does not know the type of the field");  // long double
  refuses(description({field("a", Shape::int8 + 192)}), "does not know the type of the field");
  refuses(description({field("a", Shape::nested, "p/msg/U")}),
          "lacks the type of its field 'a', p/msg/U");
  refuses(description({}, {type("p/msg/T", {})}), "the type p/msg/T twice");
  refuses(description({field("a", Shape::nested, "p/msg/T")}),
          "p/msg/T contains the type in itself");
  refuses(description({field("a", Shape::nested + Shape::kSequence, "p/msg/U")},
                      {type("p/msg/U", {field("b", Shape::nested, "p/msg/T")})}),
          "in itself");
  constexpr std::uint64_t kMuch = std::uint64_t{1} << 20;
  refuses(description({field("a", Shape::nested + Shape::kArray, "p/msg/U", kMuch)},
                      {type("p/msg/U", {field("b", Shape::int8 + Shape::kArray, {}, kMuch)})}),
          "bytes");
  refuses(description({field("a", Shape::int8 + Shape::kArray, {}, ~std::uint64_t{0})}), "bytes");
  std::vector<wire::IndividualTypeDescription> many;
  for (int i = 0; i < 1001; ++i) many.push_back(type("p/msg/U" + std::to_string(i), {}));
  refuses(description({}, many), "1001 types");
}

}  // namespace
}  // namespace takt
