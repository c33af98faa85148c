// The file that TAKT_CONFIG_TEMPLATE asks for: what TAKT_CONFIG can give to a program.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_PROGRAMS_TEMPLATE_HPP_
#define TAKT_PROGRAMS_TEMPLATE_HPP_

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "takt/executors/executor.hpp"

namespace takt::programs {

/// Notes which callbacks the nodes have at the program's first spin, or when they are added later:
/// these names are there in time at the next start, too. And what is measured of them.
/// Thread safety: none. Real-time: no.
class Template {
 public:
  /// Throws Error if there is such a file already, or none can be made: before the run, as it
  /// would be in vain.
  explicit Template(const std::string& path);

  /// `threads`: that the program has asked for; 0: it leaves their number to the type.
  void made(const Executor& executor, const std::string& type, std::size_t threads);
  /// The executor has got the node, or this group of it.
  void added(const std::shared_ptr<Node>& node, const CallbackGroup* group,
             const Executor& executor);
  void spins();
  void ends(const Executor& executor);
  /// Throws Error if it cannot be written.
  void write();

 private:
  struct Served {  // one of the program's executors
    std::string type;
    std::size_t threads = 0;
  };
  struct Callback {
    std::string name, group;
    EntityKind kind;
    int priority = 0;          // by the plan; 0: it is of no chain
    bool is_measured = false;  // not so while its executor spins at exit
    std::uint64_t received = 0;
    Histogram execution;
  };
  struct Seen {  // of a node
    std::map<std::string, std::shared_ptr<Served>> groups;
    std::vector<Callback> callbacks;  // in the order in which they were made
  };
  struct Added {
    std::weak_ptr<Node> node;
    std::string group;  // empty: all that come with the node
    std::shared_ptr<Served> served;
  };
  void see(const Added& added);
  void plan(const std::vector<std::shared_ptr<Node>>& nodes);
  std::string text() const;
  std::string comment(const Callback& callback) const;
  double seconds() const { return std::chrono::duration<double>(end_ - begin_).count(); }

  const std::string path_;
  std::map<const Executor*, std::shared_ptr<Served>> executors_;
  std::map<std::string, Seen> nodes_;
  std::string chains_;        // of the nodes at the first spin, as comments
  std::vector<Added> added_;  // before the first spin
  TimePoint begin_{}, end_{};
};

}  // namespace takt::programs

#endif  // TAKT_PROGRAMS_TEMPLATE_HPP_
