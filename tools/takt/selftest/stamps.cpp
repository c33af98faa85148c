// SPDX-License-Identifier: Apache-2.0
#include "selftest/stamps.hpp"

#include <fstream>
#include <type_traits>
#include <utility>

#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "takt/base/clock.hpp"
#include "takt/base/output_file.hpp"
#include "takt/containers/component.hpp"
#include "takt/measuring/json_text.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

// Limit: messages of a topic that `takt selftest` compares. At it: further messages are not sent.
// Seen: the count in the result.
constexpr std::size_t kMostSamples = 200'000;
constexpr std::uint64_t kTicksBetweenSamples = 50;
constexpr std::uint64_t kTicksBetweenMemory = 200;  // looking at it takes milliseconds
constexpr std::uint64_t kBetweenLongCallbacks = 20;
constexpr Nanoseconds kLongCallback = 1500us;  // more than the deadline
constexpr int kBurst = 5;
constexpr std::size_t kBurstDepth = 2;

using Small = Stamped<kSmallBytes>;
using Large = Stamped<kLargeBytes>;

std::int64_t now_ns() noexcept {
  return Clock::steady().now().time_since_epoch().count();
}

/// How often the kernel has given the CPU of this thread to another one.
std::int64_t preemptions() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nivcsw;
}

/// Of the last callback on this thread.
thread_local std::int64_t preemptions_before = -1;
thread_local bool* last_was_preempted = nullptr;

/// First in a callback, but for the clock. True: since shortly before the end of the last callback
/// on this thread, which may be right after its last reading of the clock, or right before ours.
bool was_preempted() noexcept {
  if (preemptions() == preemptions_before) return false;
  if (last_was_preempted != nullptr) *last_was_preempted = true;
  return true;
}
/// Last in a callback, but for the clock.
void remember(bool* was_preempted) noexcept {
  last_was_preempted = was_preempted;
  preemptions_before = preemptions();
}

std::uint64_t pss_kb() {
  std::uint64_t sum = 0;
  std::ifstream maps("/proc/self/smaps");
  for (std::string word; maps >> word;) {
    std::uint64_t kb = 0;
    if (word == "Pss:" && maps >> kb) sum += kb;
  }
  return sum;
}

}  // namespace

Stamps::Stamps(const NodeOptions& options)
    : Node("stamps", options),
      file_(declare_parameter<std::string>("file", "")),
      work_(std::chrono::microseconds(declare_parameter<std::int64_t>("work_us", 0))) {
  if (options.guest) {
    throw Error("only `takt selftest` uses this component, as it writes a file",
                "load takt::Workload");
  }
  exchange<Small>("small", 10, 1ms, 1, small_);
  exchange<Large>("large", 2, 50ms, 1, large_);
  exchange<Small>("burst", kBurstDepth, 50ms, kBurst, burst_);
  small_.subscription->set_parameters({.deadline = kDeadline});
}

template <class Message>
void Stamps::publish(Publisher<Message>& publisher, Topic& topic) noexcept {
  auto message = publisher.borrow_loaned_message();
  if (!message || topic.sent.size() == kMostSamples) return;
  message->number = topic.sent.size();
  message->due_ns = topic.next_due_ns;
  const std::int64_t before = preemptions();
  message->sent_ns = now_ns();
  publisher.publish(std::move(message));
  topic.sent.push_back(preemptions() != before);
}

void Stamps::work(std::uint64_t number, bool is_large) const noexcept {
  if (is_large) burn_cpu(work_);
  if (!is_large && number % kBetweenLongCallbacks == 0) burn_cpu(kLongCallback);
}

template <class Message>
void Stamps::exchange(const std::string& name, std::size_t depth, Nanoseconds period, int at_once,
                      Topic& topic) {
  topic.sent.reserve(kMostSamples);
  topic.received.reserve(kMostSamples);
  const auto publisher = create_publisher<Message>(name, depth, {.loans = depth + 2});
  topic.subscription =
      create_subscription<Message>(name, depth, [this, &topic](const Message& message) {
        Received received{message.number, message.sent_ns, message.due_ns, now_ns(), 0, false};
        received.was_preempted = was_preempted();
        if (topic.received.size() == kMostSamples) return;
        if (&topic != &burst_) work(message.number, std::is_same_v<Message, Large>);
        topic.received.push_back(received);
        remember(&topic.received.back().was_preempted);
        topic.received.back().end_ns = now_ns();
      });
  topic.timer = create_timer(name + "_timer", period, [this, publisher, at_once, &topic] {
    was_preempted();
    if (&topic == &small_ && ticks_++ % kTicksBetweenSamples == 0) sample_thread();
    if (&topic == &small_ && ticks_ % kTicksBetweenMemory == 0) pss_kb_ = pss_kb();
    for (int i = 0; i < at_once; ++i) publish(*publisher, topic);
    topic.next_due_ns = topic.timer->due().time_since_epoch().count();
    remember(nullptr);
  });
}

void Stamps::sample_thread() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  last_ = {now_ns(), thread_cpu_time().count(), usage.ru_nvcsw};
  if (first_.time_ns == 0) first_ = last_;
}

Stamps::~Stamps() {
  try {
    if (!file_.empty()) write_books();
  } catch (const std::exception&) {  // the command says that there are no books
  }
}

void Stamps::write_books() const {
  const auto topic_json = [](const Topic& topic) {
    json received = json::array();
    for (const Received& one : topic.received) {
      received.push_back({one.sent_ns, one.due_ns, one.start_ns, one.end_ns,
                          one.was_preempted || topic.sent.at(one.number)});
    }
    return json{{"sent", topic.sent.size()}, {"received", std::move(received)}};
  };
  const json books{{"small", topic_json(small_)},
                   {"large", topic_json(large_)},
                   {"burst", topic_json(burst_)},
                   {"seconds", static_cast<double>(last_.time_ns - first_.time_ns) / 1e9},
                   {"cpu_s", static_cast<double>(last_.cpu_ns - first_.cpu_ns) / 1e9},
                   {"wakeups", last_.wakeups - first_.wakeups},
                   {"pss_kb", pss_kb_}};
  write_output(file_, std::string(kTaktsJson) + rt::json_text(books));
}

}  // namespace takt::tools

TAKT_REGISTER_COMPONENT(takt::tools::Stamps, "what takt selftest compares the statistics with")
