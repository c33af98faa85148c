// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/callback_list.hpp"

#include <atomic>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "takt/testing/eventually.hpp"

namespace takt::detail {
namespace {

using List = CallbackList<void()>;
constexpr auto kFirst = List::Order::first_added;

void call_all(List& list) {
  list.each(kFirst, [](const auto& function) {
    function();
    return true;
  });
}

TEST(CallbackList, CallsInOrderUntilOneEndsIt) {
  List list;
  std::vector<int> called;
  const auto a = list.add([&] { called.push_back(1); });
  const auto b = list.add([&] { called.push_back(2); });
  call_all(list);
  list.each(List::Order::last_added, [](const auto& function) {
    function();
    return false;
  });
  EXPECT_EQ(called, (std::vector<int>{1, 2, 2}));
}

// Lists were called from a copy: a function that the one before had removed was called after that,
// with what its owner had destroyed.
TEST(CallbackList, WhatACallRemovesIsNotCalledByTheSamePass) {
  List list;
  int called = 0;
  CallbackHandle<void()> second;
  List::Entry third;
  const auto first = list.add_owned([&] {
    second.reset();
    EXPECT_TRUE(third->remove());
    EXPECT_FALSE(third->remove());
  });
  second = list.add_owned([&] { ++called; });
  third = list.add([&] { ++called; });
  call_all(list);
  EXPECT_EQ(called, 0);
}

TEST(CallbackList, ACallThatRemovesItsOwnFunctionGoesOnWithWhatThatOwns) {
  List list;
  const auto owned = std::make_shared<int>(0);
  CallbackHandle<void()> handle;
  handle = list.add_owned([&, owned] {
    handle.reset();
    ++*owned;
  });
  EXPECT_EQ(owned.use_count(), 2);
  call_all(list);
  EXPECT_EQ(*owned, 1);
  EXPECT_EQ(owned.use_count(), 1);
}

TEST(CallbackList, RemovalWaitsForACallOfAnotherThreadAndDestroysTheFunction) {
  List list;
  std::atomic<bool> is_in{false}, may_end{false}, has_ended{false};
  const auto owned = std::make_shared<int>(0);
  const auto entry = list.add([&, owned] {
    is_in.store(true);
    is_in.notify_all();
    may_end.wait(false);
    has_ended.store(true);
  });
  std::thread caller([&] { call_all(list); });
  is_in.wait(false);
  std::thread remover([&] {
    entry->remove();
    EXPECT_TRUE(has_ended.load());
    EXPECT_EQ(owned.use_count(), 1);
  });
  EXPECT_TRUE(eventually([&] { return entry->is_removed(); }));
  may_end.store(true);
  may_end.notify_all();
  remover.join();
  caller.join();
}

// Two threads whose calls remove each other's function: the one that would close the cycle does not
// wait.
TEST(CallbackList, CallsThatRemoveEachOtherDoNotWaitForEver) {
  List first, second;
  std::atomic<int> in{0};
  List::Entry a, b;
  const auto meet = [&] {
    in.fetch_add(1);
    in.notify_all();
    for (int now; (now = in.load()) < 2;) in.wait(now);
  };
  a = first.add([&] {
    meet();
    b->remove();
  });
  b = second.add([&] {
    meet();
    a->remove();
  });
  std::thread other([&] { call_all(first); });
  call_all(second);
  other.join();
  EXPECT_TRUE(a->is_gone() && b->is_gone());
}

}  // namespace
}  // namespace takt::detail
