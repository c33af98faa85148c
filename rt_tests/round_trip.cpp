// How long is a round trip between two processes over UDP, beside that of Cyclone DDS's own
// ddsperf?
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <csignal>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/measuring/ddsperf.hpp"
#include "takt/rt_tests/process_pair.hpp"
#include "takt/rt_tests/rt_test.hpp"

using namespace takt;
using namespace std::chrono_literals;

namespace {

constexpr std::size_t kBytes = 1000;
constexpr std::uint64_t kRoundTrips = 5000;

/// One side of the ping-pong: passes received messages to `receive`.
class Player {
 public:
  Player(const std::shared_ptr<Participant>& participant, const char* hears, const char* says,
         std::function<void(Player&, std::int64_t)> receive) {
    NodeOptions options;
    options.participant = participant;
    node = std::make_shared<Node>("player", options);
    const auto fresh = std::make_shared<rt::Stamp>();
    fresh->payload.resize(kBytes - 12);  // the message also has a number and a length
    publisher_ = node->create_publisher<rt::Stamp>(says, 1, {.loans = 4, .prototype = fresh});
    subscription_ = node->create_subscription<rt::Stamp>(
        hears, 1, [this, receive = std::move(receive)](const rt::Stamp& ball) {
          receive(*this, ball.sent_ns);
        });
  }
  void play(std::int64_t sent_ns) {
    auto ball = publisher_->borrow_loaned_message();
    if (ball) ball->sent_ns = sent_ns;
    publisher_->publish(std::move(ball));
  }

  std::shared_ptr<Node> node;

 private:
  std::shared_ptr<Publisher<rt::Stamp>> publisher_;
  std::shared_ptr<Subscription<rt::Stamp>> subscription_;
};

/// The peer process, which ends with this one.
class Other {
 public:
  explicit Other(const std::function<void()>& body) : pid_(fork()) {
    if (pid_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    body();
    _exit(127);
  }
  ~Other() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Other(const Other&) = delete;
  Other& operator=(const Other&) = delete;

 private:
  const pid_t pid_;
};

void pong(const DdsOptions& dds) {
  const auto executor = rt::executor_on({.name = "pong", .affinity = dds.threads.affinity});
  Player player(Participant::create(dds), "/ping", "/pong", &Player::play);
  executor->add_node(player.node);
  executor->spin();
}

std::int64_t now_ns() {
  return Clock::steady().now().time_since_epoch().count();
}

Histogram ping(const std::shared_ptr<Participant>& participant, const std::vector<int>& affinity) {
  const auto executor = rt::executor_on({.name = "ping", .affinity = affinity});
  Histogram round_trips;
  std::atomic<bool> is_known = false;
  Player player(participant, "/pong", "/ping", [&](Player& self, std::int64_t sent_ns) {
    if (sent_ns == 0) {
      is_known = true;
      return;
    }
    const std::int64_t now = now_ns();
    round_trips.record(Nanoseconds(now - sent_ns));
    if (round_trips.count() == kRoundTrips) return executor->cancel();
    self.play(now);
  });
  executor->add_node(player.node);
  std::thread spin([&] { executor->spin(); });
  while (!is_known) {  // until discovery is complete in both processes
    player.play(0);
    std::this_thread::sleep_for(10ms);
  }
  player.play(now_ns());
  spin.join();
  return round_trips;
}

// ddsperf responds on the receiving thread or, like executors, on a thread that waits for messages.
enum class Mode { listener, waitset };
const char* name(Mode mode) {
  return mode == Mode::listener ? "listener" : "waitset";
}

int domain_of(int takts, Mode mode) {
  return takts + 1 + static_cast<int>(mode);
}

/// The median round trip in µs. ddsperf prints half of it, the mean of both directions.
double ddsperf_ping(int domain, Mode mode) {
  const std::string command = fmt::format("taskset -c 0 ddsperf -i {} -D 2.5 ping size {} {} 2>&1",
                                          domain_of(domain, mode), kBytes, name(mode));
  double p50 = 0;
  rt::for_each_line(command, [&](const std::string& line) {
    if (const auto at = line.find(" 50% "); at != line.npos)
      p50 = 2 * std::stod(line.substr(at + 5));
  });
  if (p50 == 0) throw Error("ddsperf printed no measurement");
  return p50;
}

}  // namespace

int main(int argc, char** argv) {
  rt::RtTest test(
      argc, argv,
      "How long is a round trip between two processes over UDP, compared with ddsperf? (1 KB, "
      "SCHED_OTHER, all on one CPU, to exclude wake-ups of other CPUs)");
  if (const std::string why = rt::why_no_ddsperf(); !why.empty()) test.skip(why);
  const int domain = 20 + 3 * (getpgrp() % 27);
  const std::vector<int> cpu{0};
  const DdsOptions dds{.domain = domain, .threads = {.affinity = cpu}};
  const Other takt_pong([&] { pong(dds); });
  const auto ddsperf_pong = [&](Mode mode) {
    if (std::freopen("/dev/null", "w", stdout) == nullptr) return;
    const std::string id = std::to_string(domain_of(domain, mode));
    rt::keep_ddsperf_on_loopback();
    execlp("taskset", "taskset", "-c", "0", "ddsperf", "-i", id.c_str(), "pong", name(mode),
           nullptr);
  };
  const Other listener([&] { ddsperf_pong(Mode::listener); });
  const Other waitset([&] { ddsperf_pong(Mode::waitset); });
  const auto participant = Participant::create(dds);
  std::vector<double> takt_us, listener_us, waitset_us;
  for (int round = 0; round < test.rounds(3); ++round) {
    listener_us.push_back(ddsperf_ping(domain, Mode::listener));
    takt_us.push_back(rt::us(ping(participant, cpu).percentile(0.5)));
    waitset_us.push_back(ddsperf_ping(domain, Mode::waitset));
  }
  test.add("ddsperf, on the thread that receives", {{"p50_us", rt::median(listener_us)}});
  test.add("ddsperf, on a thread that waits", {{"p50_us", rt::median(waitset_us)}});
  test.add("Takt, in a callback", {{"p50_us", rt::median(takt_us)}});
  test.expect_at_most(
      1.15, takt_us, waitset_us,
      "a callback's round trip takes at most 1.15 times that of ddsperf on a thread "
      "that waits");
  return test.finish();
}
