// takt topic: shows the topics on the domain, receives from them and publishes to them.
// SPDX-License-Identifier: Apache-2.0
#include "topic/topic.hpp"

#include <memory>
#include <thread>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "graph/dynamic_message.hpp"
#include "graph/type_finder.hpp"
#include "prompt/values.hpp"

namespace takt::tools::topic_command {
namespace {

/// As `ros2 topic pub` does: for ever unless there is a limit, and says so every second.
void await_subscriptions(const GenericPublisher& publisher, const Options& options) {
  using namespace std::chrono_literals;
  const TimePoint begin = Clock::steady().now();
  TimePoint next_line = begin;
  const bool is_endless = options.rate_hz != 0 && options.count == 0;
  const std::size_t wanted = options.wanted_subscriptions.value_or(is_endless ? 0 : 1);
  for (;;) {
    const TimePoint now = Clock::steady().now();
    const std::size_t count = publisher.subscription_count();
    if (count >= wanted) return;
    if (options.wait_limit != 0s && now - begin >= options.wait_limit) {
      throw Error(fmt::format("'{}' has {} subscriptions after {}, not {}", publisher.topic(),
                              count, to_string(options.wait_limit), wanted),
                  "check the name with takt topic list");
    }
    if (now >= next_line) {
      rt::to_stderr("waiting for {} subscription(s) of '{}'\n", wanted, publisher.topic());
      next_line = later(next_line, 1s);
    }
    std::this_thread::sleep_for(5ms);
  }
}

void pub(const Options& options) {
  Observer observer(options);
  const ByteBuffer message =
      write_message(TypeFinder(observer).require(options.type), options.message);
  const auto publisher =
      observer.node().create_generic_publisher(absolute(options.topic), options.type, QoS(10));
  await_subscriptions(*publisher, options);
  publisher->publish(message.bytes());
  std::uint64_t count = 1;
  const std::uint64_t most = options.rate_hz == 0 ? 1 : options.count;
  if (count != most) {
    const auto timer = observer.node().create_timer(
        "send", Nanoseconds(static_cast<std::int64_t>(1e9 / options.rate_hz)), [&] {
          publisher->publish(message.bytes());
          if (++count == most) observer.stop();
        });
    observer.add(timer);
    observer.run(options.duration, /*ends_by_itself=*/most != 0);
  }
  std::this_thread::sleep_for(
      std::chrono::milliseconds(100));  // so that messages in transit arrive
}

void set_up_pub(CLI::App& command, const std::shared_ptr<Options>& options) {
  add_library_option(command, options->libraries);
  command.add_option("TYPE", options->type, "The type, for example std_msgs/msg/String")
      ->required();
  command.add_option("MESSAGE", options->message, "The message as YAML; missing fields are zero");
  number(command.add_option("-r,--rate", options->rate_hz,
                            "Messages per second (default: only one message)"),
         0.001, 1e6);
  command.add_option("-n,--count", options->count, "With --rate: stop after this many messages");
  add_time_option(command, "--duration", options->duration, "With --rate: stop after this time");
  command.add_option("-w,--wait-matching-subscriptions", options->wanted_subscriptions,
                     "Begin when there are so many (default: 1; 0 with --rate without --count)");
  add_time_option(command, "--max-wait-time-secs", options->wait_limit,
                  "Wait no longer for them (default: until Ctrl-C)");
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  const auto add = [&](const char* name, const char* what, void (*function)(const Options&),
                       bool has_topic = true, bool has_json = true) {
    CLI::App* sub = command->add_subcommand(name, what);
    if (has_topic) sub->add_option("TOPIC", options->topic, "Its name")->required();
    add_observer_options(*sub, *options, has_json);
    sub->callback([options, function] { function(*options); });
    return sub;
  };
  const auto add_listening = [&](CLI::App* sub) {
    add_time_option(*sub, "--duration", options->duration,
                    "End after this time (default: until Ctrl-C)");
    sub->add_option("--type", options->type, "The type, if discovery reports several or none");
    return sub;
  };
  const auto add_all = [&](CLI::App* sub) {
    sub->add_flag("-a,--all", options->all, "Include hidden topics, whose names begin with '_'");
    return sub;
  };
  add_all(add("list", "Lists all topics", list, false))
      ->add_flag("-t,--show-types", options->shows_types,
                 "Print NAME [TYPE] of each, as ros2 does");
  add("info", "Shows publishers and subscriptions, with their QoS", info)
      ->add_flag("-v,--verbose", options->verbose, "Print all that is known, as ros2 does");
  add("type", "Prints the type of a topic", type, true, false);
  CLI::App* find_command = add_all(add("find", "Prints the topics of a type", find, false, false));
  find_command->add_option("TYPE", options->type, "The type, for example std_msgs/msg/String")
      ->required();
  find_command->add_flag("-c,--count-topics", options->counts, "Print only their number");
  for (const auto& [name, what, function] :
       {std::tuple("hz", "Prints the message rate every second", &hz),
        std::tuple("bw", "Prints the bandwidth every second", &bw),
        std::tuple("delay", "Prints the age of messages with a header every second", &delay)}) {
    CLI::App* sub = add_listening(add(name, what, function));
    whole_number(sub->add_option("--window", options->window,
                                 "Number of last messages that are evaluated (default: 1000)"),
                 1, 1'000'000);
    if (function == &delay) add_library_option(*sub, options->libraries);
  }
  CLI::App* echo_command = add_listening(add("echo", "Prints each message", echo));
  add_library_option(*echo_command, options->libraries);
  echo_command->add_option("-n,--count", options->count, "Stop after this many messages");
  echo_command->add_flag("--full", options->full, "Print all elements of long arrays");
  echo_command->add_flag("--raw", options->raw, "Print bytes, for types that nobody knows");
  set_up_pub(*add("pub", "Publishes a message, once or repeatedly", pub, true, false), options);
  command->footer(
      "Example:\n"
      "  takt topic list\n"
      "  takt topic info /scan -v\n"
      "  takt topic type /scan\n"
      "  takt topic find sensor_msgs/msg/LaserScan\n"
      "  takt topic hz /scan --duration 4s\n"
      "  takt topic bw /scan --window 100\n"
      "  takt topic delay /scan\n"
      "  takt topic echo /odom -n 1\n"
      "  takt topic echo /weather --library libweather.so\n"
      "  takt topic pub /cmd_vel geometry_msgs/msg/Twist '{linear: {x: 0.2}}' --rate 10\n");
}
const Command registered("topic", "Shows and uses topics on a DDS domain, including ROS 2's",
                         set_up);

}  // namespace
}  // namespace takt::tools::topic_command
