// SPDX-License-Identifier: Apache-2.0
#include "top/watch.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <set>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/measuring/output.hpp"
#include "takt/messages/entries.hpp"

#include "exit_status.hpp"
#include "graph/service_call.hpp"
#include "run/live_line.hpp"

namespace takt::tools::top {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view kService = "/get_statistics";
constexpr std::string_view kType = "takt_interfaces/srv/GetStatistics";

// Of all containers together, as each has several.
// Limit: rows of all tables that takt top reads in one interval. At it: a container that answers
// with more than its share, and with more than 500, is not shown. Seen: its state.
constexpr std::size_t kMostRows = 100'000;
constexpr std::size_t kLeastShare = 500;

std::size_t rows_of(const GetStatistics::Response& answer) {
  return answer.threads.size() + answer.executors.size() + answer.callbacks.size() +
         answer.chains.size() + answer.topics.size() + answer.deviations.size();
}

// Also if it is somebody else's.
bool lives(int pid) {
  return kill(pid, 0) == 0 || errno == EPERM;
}

}  // namespace

const char* to_string(Watched::State state) {
  switch (state) {
    case Watched::State::running:
      return "running";
    case Watched::State::silent:
      return "does not answer";
    case Watched::State::ended:
      return "ended";
    case Watched::State::gone:
      return "gone";
    case Watched::State::ambiguous:
      return "several processes have this name";
    case Watched::State::refused:
      return "answers with too many rows";
  }
  return "";
}

struct Watch::Asked {
  std::shared_ptr<Client<GetStatistics>> client;
  std::optional<Future<Client<GetStatistics>::Answer>> answer;
  GetStatistics::Response before;
  bool is_ambiguous = false;                // the next answer might be of another process
  bool is_here = false;                     // its process lived on this host when it last answered
  TimePoint heard = Clock::steady().now();  // its last answer; before that, when it was found
};

Watch::Watch(int domain, const std::vector<std::string>& names, Nanoseconds patience)
    : finds_all_(names.empty()), patience_(patience) {
  DdsOptions options{.domain = domain};
  options.shared_memory = SharedMemory::off;
  participant_ = Participant::create(options);
  begin_work();
  node_ = std::make_shared<Node>(fmt::format("_takt_{}", getpid()),
                                 NodeOptions{.participant = participant_});
  std::set<std::string> wanted;
  for (const std::string& name : names)
    wanted.insert(name.starts_with('/') ? name.substr(1) : name);
  std::vector<std::string> known;
  std::string missing;
  const auto is_there = [&] {
    known.clear();
    for (const auto& [name, count] : found()) known.push_back(name);
    missing.clear();
    for (const std::string& name : wanted) {
      if (std::find(known.begin(), known.end(), name) == known.end()) missing = name;
    }
    return missing.empty() && !known.empty();
  };
  {
    const LiveLine line(kDiscovering);
    const auto start = std::chrono::steady_clock::now();
    const auto limit = start + 3500ms;
    while (std::chrono::steady_clock::now() < limit) {
      const bool is_early = wanted.empty() && std::chrono::steady_clock::now() < start + 500ms;
      if (is_there() && !is_early) break;
      std::this_thread::sleep_for(20ms);
    }
  }
  if (!missing.empty()) {
    throw Error(fmt::format("container '{}' was not found within 3 s", missing),
                known.empty() ? "check that it runs on the same DDS domain (--domain, "
                                "ROS_DOMAIN_ID), and that its file has the key 'dds'"
                              : suggest(missing, known));
  }
  if (known.empty()) {
    throw Error(fmt::format("no container on DDS domain {}", domain),
                "start one whose file has the key 'dds', or name its domain (--domain, "
                "ROS_DOMAIN_ID)");
  }
  if (wanted.empty() && known.size() == kMostAsked) {
    rt::to_stderr("note: only {} containers are asked; name those that are meant\n", kMostAsked);
  }
  for (const std::string& name : wanted.empty() ? std::set(known.begin(), known.end()) : wanted) {
    add(name);
  }
  executor_ = executors().make("events", {.name = "answers"});
  executor_->add_node(node_);
  thread_ = std::thread([this] { executor_->spin(); });
}

Watch::~Watch() {
  if (!thread_.joinable()) return;
  executor_->cancel();
  thread_.join();
}

// The names, and how many have each.
std::map<std::string, std::size_t> Watch::found() const {
  return owners_in(participant_->graph(), kService, kType, finds_all_ ? kMostAsked : SIZE_MAX);
}

void Watch::add(const std::string& name) {
  asked_.push_back(std::make_unique<Asked>());
  asked_.back()->client = node_->create_client<GetStatistics>(service_of(name, kService.data()));
  shown_.push_back({.name = name});
}

// One that has gone makes room for one that comes.
bool Watch::has_room() {
  if (asked_.size() < kMostAsked) return true;
  for (std::size_t i = 0; i < asked_.size(); ++i) {
    if (asked_[i]->client->service_is_ready()) continue;
    asked_.erase(asked_.begin() + static_cast<std::ptrdiff_t>(i));
    shown_.erase(shown_.begin() + static_cast<std::ptrdiff_t>(i));
    return true;
  }
  return false;
}

std::size_t Watch::most_rows() const {
  return std::clamp(kMostRows / std::max<std::size_t>(asked_.size(), 1), kLeastShare, kMostEntries);
}

void Watch::ask() {
  const std::map<std::string, std::size_t> now = found();
  for (const auto& entry : now) {
    const auto is_it = [&](const Watched& known) { return known.name == entry.first; };
    if (finds_all_ && std::none_of(shown_.begin(), shown_.end(), is_it) && has_room()) {
      add(entry.first);
    }
  }
  for (std::size_t i = 0; i < asked_.size(); ++i) {
    const auto& asked = asked_[i];
    const auto known = now.find(shown_[i].name);
    asked->is_ambiguous = known != now.end() && known->second > 1;
    if (asked->answer && !asked->answer->ready() && asked->client->service_is_ready()) continue;
    asked->answer.reset();
    if (asked->is_ambiguous || !asked->client->service_is_ready()) continue;
    asked->answer = asked->client->async_send_request({});
  }
}

bool Watch::has_answers() const {
  return std::all_of(asked_.begin(), asked_.end(),
                     [](const auto& asked) { return !asked->answer || asked->answer->ready(); });
}

bool Watch::has_begun() const {
  const TimePoint now = Clock::steady().now();
  return std::all_of(asked_.begin(), asked_.end(), [&](const auto& asked) {
    return asked->before.pid != 0 || asked->is_ambiguous || now >= later(asked->heard, patience_);
  });
}

// One that is stopped leaves the graph as one that has ended does.
Watched::State Watch::state_without_answer(const Asked& asked, const Watched& shown) const {
  const bool has_left = asked.before.pid != 0 && !asked.client->service_is_ready();
  if (has_left && !asked.is_here) return Watched::State::gone;
  if (has_left && !lives(shown.pid)) return Watched::State::ended;
  const bool is_late = Clock::steady().now() < later(asked.heard, patience_);
  return is_late && !has_left ? shown.state : Watched::State::silent;
}

void Watch::take() {
  for (std::size_t i = 0; i < asked_.size(); ++i) {
    Asked& asked = *asked_[i];
    Watched& shown = shown_[i];
    shown.is_new = false;
    if (asked.is_ambiguous) {
      shown.state = Watched::State::ambiguous;
      continue;
    }
    Client<GetStatistics>::Answer answer;
    if (asked.answer && asked.answer->ready()) {
      answer = asked.answer->get();
      asked.answer.reset();
    }
    if (!answer) {
      shown.state = state_without_answer(asked, shown);
      continue;
    }
    if (rows_of(*answer) > most_rows() || !why_too_long(*answer).empty()) {
      shown.state = Watched::State::refused;
      asked.before = {};
      asked.before.pid = answer->pid;  // it has begun
      continue;
    }
    shown.is_new = true;
    shown.state = Watched::State::running;
    shown.pid = answer->pid;
    shown.last = interval(asked.before, *answer);
    asked.heard = Clock::steady().now();
    asked.is_here = lives(answer->pid);
    asked.before = std::move(*answer);
  }
}

}  // namespace takt::tools::top
