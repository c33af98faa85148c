// Tests of the one rule by which values become those of a parameter's type.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"
#include "takt/nodes/node.hpp"

namespace takt::parameter_widening_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

using Integers = std::vector<std::int64_t>;
using Numbers = std::vector<double>;

/// Declares a parameter with this default; the configuration gives the value.
template <class T>
T declared(const ParameterValue& given, const T& usual) {
  const auto node = std::make_shared<Node>("camera", NodeOptions{.parameters = {{"p", given}}});
  const T value = node->declare_parameter("p", usual);
  EXPECT_EQ(node->get_parameter<T>("p"), value);
  return value;
}

// An integer was taken for a floating-point number, but a list of integers for none.
TEST(ParameterWidening, IntegersStandForFloatingPointNumbersAlsoInLists) {
  EXPECT_EQ(declared<double>(std::int64_t{2}, 0.5), 2.0);
  EXPECT_EQ(declared<float>(std::int64_t{2}, 0.5f), 2.0f);
  EXPECT_THAT(declared<Numbers>(Integers{1, 2}, {0.5}), ElementsAre(1.0, 2.0));
  EXPECT_THAT(declared<std::vector<float>>(Integers{1, 2}, {0.5f}), ElementsAre(1.0f, 2.0f));
}

TEST(ParameterWidening, IntegersStandForBytesInListsIfTheyAreSuch) {
  EXPECT_THAT(declared<std::vector<std::uint8_t>>(Integers{0, 255}, {}), ElementsAre(0, 255));
  EXPECT_THAT([] { declared<std::vector<std::uint8_t>>(Integers{256}, {}); },
              ThrowsMessage<Error>(HasSubstr("cannot be [256]; give a byte array")));
}

// `[]` has no type in a file, which refused it.
TEST(ParameterWidening, AnEmptyListIsOneOfAnyType) {
  const ParameterValue empty = std::vector<std::string>{};
  EXPECT_THAT(declared<std::vector<bool>>(empty, {true}), IsEmpty());
  EXPECT_THAT(declared<std::vector<std::uint8_t>>(empty, {1}), IsEmpty());
  EXPECT_THAT(declared<Integers>(empty, {1}), IsEmpty());
  EXPECT_THAT(declared<Numbers>(empty, {1}), IsEmpty());
  EXPECT_THAT(declared<std::vector<std::string>>(empty, {"a"}), IsEmpty());
  EXPECT_THAT(declared<std::vector<std::string>>(Integers{}, {"a"}), IsEmpty());
  EXPECT_THAT([&] { declared<std::string>(empty, "a"); },
              ThrowsMessage<Error>(HasSubstr("cannot be []; give a string")));
}

TEST(ParameterWidening, NothingElseIsConverted) {
  const auto is_refused = []<class T>(const ParameterValue& given, const T& usual) {
    EXPECT_THAT([&] { declared<T>(given, usual); }, ThrowsMessage<Error>(HasSubstr("cannot be")));
  };
  is_refused(2.0, 1);
  is_refused(Numbers{2.0}, Integers{1});
  is_refused(std::string("1"), 1);
  is_refused(std::int64_t{1}, std::string("a"));
  is_refused(std::int64_t{1}, true);
  is_refused(true, 1);
  is_refused(std::int64_t{1}, Integers{1});
  is_refused(Integers{1}, std::vector<std::string>{"a"});
}

// The code may have narrower types, in lists as elsewhere.
TEST(ParameterWidening, ListsOfNarrowTypesHoldWhatFits) {
  EXPECT_THAT(declared<std::vector<int>>(Integers{1, -2}, {0}), ElementsAre(1, -2));
  EXPECT_THAT(
      [] {
        declared<std::vector<int>>(Integers{1, std::int64_t{1} << 40}, {0});
      },
      ThrowsMessage<Error>(HasSubstr("cannot be [1, 1099511627776]")));
  EXPECT_THAT([] { declared<std::vector<std::uint16_t>>(Integers{-1}, {}); },
              ThrowsMessage<Error>(HasSubstr("cannot be [-1]")));
  const auto node = std::make_shared<Node>("camera");
  node->declare_parameter("p", Integers{std::int64_t{1} << 40});
  EXPECT_THAT([&] { node->get_parameter<std::vector<int>>("p"); },
              ThrowsMessage<Error>(HasSubstr("read it as a wider integer")));
}

TEST(ParameterWidening, HoldsForValuesThatAreSet) {
  const auto node = std::make_shared<Node>("camera");
  node->declare_parameter("gains", Numbers{0.5});
  EXPECT_TRUE(node->set_parameters_atomically({{"gains", Integers{3}}}).successful);
  EXPECT_THAT(node->get_parameter<Numbers>("gains"), ElementsAre(3.0));
  EXPECT_TRUE(node->set_parameters_atomically({{"gains", Integers{}}}).successful);
  EXPECT_THAT(node->get_parameter<Numbers>("gains"), IsEmpty());
}

}  // namespace
}  // namespace takt::parameter_widening_test
