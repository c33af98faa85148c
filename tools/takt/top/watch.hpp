// Asks running containers again and again what they have done.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TOP_WATCH_HPP_
#define TAKT_TOOLS_TAKT_TOP_WATCH_HPP_

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "takt/base/future.hpp"
#include "takt/containers/get_statistics.hpp"
#include "takt/containers/statistics_interval.hpp"
#include "takt/executors/executor.hpp"

namespace takt::tools::top {

/// A container, as it was when it last answered.
struct Watched {
  /// gone: its service has, and whether it has ended is not known here. refused: it answers with
  /// more rows than are read.
  enum class State { running, silent, ended, gone, ambiguous, refused };
  std::string name;
  State state = State::silent;
  int pid = 0;
  StatisticsInterval last;
  bool is_new = false;  // `last` is of this interval
};

/// "running", "does not answer", "ended", "gone", "several processes have this name", "answers with
/// too many rows".
const char* to_string(Watched::State state);

/// The containers on a domain that are watched.
/// Thread safety: one thread calls; another one receives the answers.
/// Real-time: no.
class Watch {
 public:
  /// All containers, also those that come later, where `names` is empty. Waits for discovery.
  /// Throws Error if one of the names, or any container at all, is not found.
  /// An answer may be late by `patience` before its container is said not to answer.
  Watch(int domain, const std::vector<std::string>& names, Nanoseconds patience);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Sends each a request. take() may follow when has_answers(), or whenever the caller likes.
  void ask();
  bool has_answers() const;
  /// What they have done since they answered before.
  void take();
  /// All have answered once, or had time to.
  bool has_begun() const;
  const std::vector<Watched>& containers() const noexcept { return shown_; }

 private:
  struct Asked;
  std::map<std::string, std::size_t> found() const;
  void add(const std::string& name);
  bool has_room();
  std::size_t most_rows() const;
  Watched::State state_without_answer(const Asked& asked, const Watched& shown) const;

  const bool finds_all_;
  const Nanoseconds patience_;
  std::shared_ptr<Participant> participant_;
  std::shared_ptr<Node> node_;
  std::unique_ptr<Executor> executor_;
  std::thread thread_;
  std::vector<std::unique_ptr<Asked>> asked_;
  std::vector<Watched> shown_;  // of each
};

}  // namespace takt::tools::top

#endif  // TAKT_TOOLS_TAKT_TOP_WATCH_HPP_
