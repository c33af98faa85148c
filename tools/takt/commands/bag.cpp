// takt bag: records topics of a domain, plays recordings, and shows what is in them.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cmath>
#include <ctime>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "takt/base/counted.hpp"
#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/components/player.hpp"
#include "takt/components/recorder.hpp"
#include "takt/executors/executor.hpp"
#include "takt/measuring/output.hpp"
#include "takt/messages/type_description.hpp"
#include "takt/ros2/type_description_service.hpp"

#include "commands.hpp"
#include "exit_status.hpp"
#include "graph/type_finder.hpp"
#include "outputs.hpp"
#include "prompt/values.hpp"
#include "run/end_signals.hpp"
#include "run/live_line.hpp"
#include "run/result_json.hpp"

namespace takt::tools::bag_command {
namespace {

using json = nlohmann::ordered_json;
using namespace std::chrono_literals;

// Of the search for topics that come later: twelve days, the largest value of the parameter.
constexpr std::int64_t kForeverMs = std::int64_t{1} << 30;

struct Options : ObserverOptions {
  std::string file, compression = "none";
  std::vector<std::string> topics;
  Nanoseconds duration{0}, start_offset{0}, delay = 500ms;
  double rate = 1;
  bool loop = false, clock = false;

  bool prints() const { return json_path != "-"; }
};

/// Runs the node until a signal, the end of the duration (0: none), or `is_over`, which is looked
/// at ten times a second. Returns the signal, or 0.
template <class IsOver>
int run(const std::shared_ptr<Node>& node, const char* what, const EndSignals& signals,
        Nanoseconds duration, IsOver is_over) {
  Logger::instance().set_level(LogLevel::warn);  // the command itself says what it has done
  const auto executor = executors().make("single_threaded", {.name = "bag"});
  const auto control = std::make_shared<Node>("control");
  int signal = 0;
  const auto take = control->create_file_descriptor(
      "signals", signals.fd(), FileDescriptorEvents::readable, [&](FileDescriptorEvents) {
        if (const int taken = signals.take(); taken != 0) signal = taken;
        if (signal != 0) executor->cancel();
      });
  const auto look = control->create_timer("look", 100ms, [&] {
    if (is_over()) executor->cancel();
  });
  std::shared_ptr<Timer> end;
  if (duration != 0ns) {
    end = control->create_timer("end", duration, [&] { executor->cancel(); });
  }
  executor->add_node(node);
  executor->add_node(control);
  const LiveLine line(what);
  executor->spin();
  return signal;
}

// ---- record ----

std::string default_file() {
  return fmt::format("takt_{:%Y_%m_%d-%H_%M_%S}.mcap", fmt::localtime(std::time(nullptr)));
}

void record(const Options& options) {
  if (options.topics.empty() && !options.all) {
    throw Error("nothing to record", "name topics, or record all with --all");
  }
  const EndSignals signals;  // before any thread
  const std::string file = options.file.empty() ? default_file() : options.file;
  const Observer observer(options);
  NodeOptions node;
  node.participant = observer.participant();
  node.parameters = {{"file", file},
                     {"topics", options.topics},
                     {"discover_ms", kForeverMs},
                     {"compression", options.compression}};
  TypeFinder finder(observer);
  const auto define = [&](const std::string& type) {
    const MessageType* known = finder.find_here(type);
    return known != nullptr ? message_definition(*known) : "";
  };
  const auto recorder = as_usage([&] { return std::make_shared<Recorder>(node, define); });
  if (options.prints()) {
    rt::to_stderr("recording to {}; Ctrl-C ends it\n", file);
  }
  const int signal =
      run(recorder, "recording", signals, options.duration, [&] { return recorder->has_ended(); });
  const std::string failure = recorder->complete();
  if (options.prints()) {
    rt::print("{}: {} of {}, {} dropped\n", file, counted(recorder->recorded(), "message"),
              counted(recorder->topic_count(), "topic"), recorder->dropped());
  }
  if (!options.json_path.empty()) {
    write_json({{"file", file},
                {"topics", recorder->topic_count()},
                {"messages", recorder->recorded()},
                {"dropped", recorder->dropped()}},
               options.json_path);
  }
  if (!failure.empty()) throw Error(failure, "see --compression, or record fewer topics", file);
  check_complete(signal, /*ends_by_itself=*/options.duration != 0ns);
}

// ---- play ----

std::int64_t milliseconds(Nanoseconds time) {
  return time / 1ms;
}

void play(const Options& options) {
  const EndSignals signals;
  const Observer observer(options);
  NodeOptions node;
  node.participant = observer.participant();
  node.parameters = {{"file", options.file},
                     {"topics", options.topics},
                     {"rate", options.rate},
                     {"loop", options.loop},
                     {"clock", options.clock},
                     {"start_offset_ms", milliseconds(options.start_offset)},
                     {"start_delay_ms", std::max<std::int64_t>(milliseconds(options.delay), 1)}};
  const auto player = as_usage([&] { return std::make_shared<Player>(node); });
  const TypeDescriptionService describes(*player, *player);  // those registered
  const int signal = run(player, "playing", signals, 0ns, [&] { return player->has_ended(); });
  if (options.prints()) rt::print("played: {}\n", counted(player->played(), "message"));
  if (!options.json_path.empty()) {
    write_json({{"file", options.file}, {"messages", player->played()}}, options.json_path);
  }
  check_complete(signal, /*ends_by_itself=*/!options.loop);
}

// ---- info ----

std::string human_size(std::uint64_t bytes) {
  if (bytes < 1024) return fmt::format("{} B", bytes);
  double size = static_cast<double>(bytes);
  const char* unit = "";
  for (const char* next : {"KiB", "MiB", "GiB", "TiB"}) {
    if (size < 1024) break;
    size /= 1024;
    unit = next;
  }
  return fmt::format("{:.1f} {}", size, unit);
}

std::string time_text(std::uint64_t ns) {
  const auto seconds = static_cast<std::time_t>(ns / 1'000'000'000);
  return fmt::format("{:%b %e %Y %H:%M:%S}.{:09} ({}.{:09})", fmt::localtime(seconds),
                     ns % 1'000'000'000, seconds, ns % 1'000'000'000);
}

void info(const Options& options) {
  const McapReader reader(options.file);
  const std::vector<RecordedMessage>& messages = reader.messages();
  std::vector<std::uint64_t> counts(reader.topics().size());
  for (const RecordedMessage& message : messages) ++counts[message.topic];
  const std::uint64_t first = messages.empty() ? 0 : messages.front().log_time_ns;
  const std::uint64_t last = messages.empty() ? 0 : messages.back().log_time_ns;
  std::set<std::string> compressions = reader.compressions();
  compressions.erase("");

  if (options.prints()) {
    const auto line = [](const char* key, const std::string& value) {
      rt::print("{:<19}{}\n", key, value);
    };
    line("Files:", options.file);
    line("Bag size:", human_size(reader.size()));
    line("Storage id:", "mcap");
    if (!compressions.empty())
      line("Compression:", fmt::format("{}", fmt::join(compressions, ", ")));
    line("Duration:", fmt::format("{:.9f}s", static_cast<double>(last - first) / 1e9));
    line("Start:", time_text(first));
    line("End:", time_text(last));
    line("Messages:", std::to_string(messages.size()));
    const char* key = "Topic information:";
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const RecordedTopic& topic = reader.topics()[i];
      line(std::exchange(key, ""),
           fmt::format("Topic: {} | Type: {} | Count: {} | Serialization Format: cdr", topic.topic,
                       topic.type, counts[i]));
    }
    if (!reader.is_complete()) rt::to_stderr("the file is incomplete: the recording was cut off\n");
  }
  if (options.json_path.empty()) return;
  json topics = json::array();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const RecordedTopic& topic = reader.topics()[i];
    topics.push_back({{"topic", topic.topic},
                      {"type", topic.type},
                      {"count", counts[i]},
                      {"has_definition", !topic.definition.empty()}});
  }
  write_json({{"file", options.file},
              {"size_bytes", reader.size()},
              {"storage", "mcap"},
              {"compressions", compressions},
              {"is_complete", reader.is_complete()},
              {"start_ns", first},
              {"end_ns", last},
              {"messages", messages.size()},
              {"topics", topics}},
             options.json_path);
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  CLI::App* record_command =
      command->add_subcommand("record", "Records topics to an MCAP file until Ctrl-C");
  add_observer_options(*record_command, *options);
  add_library_option(*record_command, options->libraries);
  record_command->add_option("TOPIC", options->topics, "The topics' names");
  record_command->add_flag("-a,--all", options->all,
                           "Record all topics, also those that come later");
  add_output(*record_command, "-o,--output", options->file,
             "The file (default: takt_DATE-TIME.mcap)");
  one_of(record_command->add_option("--compression", options->compression,
                                    "Of the file's chunks (default: none)"),
         {compressions().begin(), compressions().end()});
  add_time_option(*record_command, "--duration", options->duration,
                  "End after this time (default: until Ctrl-C)");
  record_command->callback([options] { record(*options); });

  CLI::App* play_command = command->add_subcommand(
      "play", "Publishes the messages of an MCAP file, of takt's or ros2 bag's");
  add_observer_options(*play_command, *options);
  add_library_option(*play_command, options->libraries);
  play_command->add_option("FILE", options->file, "The recording")->required();
  number(play_command->add_option("-r,--rate", options->rate,
                                  "Speed: 2 is twice as fast as recorded (default: 1)"),
         0.001, 1000);
  play_command->add_flag("-l,--loop", options->loop, "Begin again at the end, until Ctrl-C");
  play_command->add_option("--topics", options->topics, "Play only these topics");
  add_time_option(*play_command, "--start-offset", options->start_offset,
                  "How much of the recording to leave out at its begin", Zero::permitted);
  play_command->add_flag("--clock", options->clock, "Publish the recorded time on /clock");
  add_time_option(*play_command, "-d,--delay", options->delay,
                  "Time until the first message, for discovery (default: 500ms)", Zero::permitted);
  play_command->callback([options] { play(*options); });

  CLI::App* info_command = command->add_subcommand("info", "Shows what is in an MCAP file");
  info_command->add_option("FILE", options->file, "The recording")->required();
  add_output(*info_command, "--json", options->json_path, "Also write it as JSON; - for stdout");
  info_command->callback([options] { info(*options); });
  command->footer(
      "Example:\n"
      "  takt bag record --all -o drive.mcap --compression zstd\n"
      "  takt bag info drive.mcap\n"
      "  takt bag play drive.mcap --rate 2 --library libweather.so\n");
}
const Command registered("bag", "Records, plays and shows messages, as ros2 bag does", set_up);

}  // namespace
}  // namespace takt::tools::bag_command
