// All executors of a system, solved together. Private to the analysis.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ANALYSIS_SOLVER_HPP_
#define TAKT_ANALYSIS_SOLVER_HPP_

#include <memory>
#include <string>
#include <vector>

#include "takt/analysis/analysis.hpp"
#include "takt/analysis/method.hpp"
#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_INTERNAL analysis {

/// A path with what is known of it.
struct AnalysedPath {
  Path path;
  Time bound = 0;
  std::vector<MethodBound> answers;
  std::vector<Term> terms;
  std::string why_not = {};  // when it first had no bound
};

/// Solves the system when it is constructed, and then answers.
/// Thread safety: as a value. Real-time: no.
class Solver {
 public:
  Solver(const System& system, const Options& options);

  const Output& link(const Chain& chain, std::size_t place) const;
  ChainBound bound(const Chain& chain) const;
  CallbackBound bound(std::size_t callback) const;

 private:
  void order_callbacks();
  void make_sources();
  void add_source(Source source);
  void make_paths(Part& part);
  void extend(AnalysedPath path);
  bool improve(int round);
  void analyse(AnalysedPath& path) const;
  void note_cause(AnalysedPath& path);
  void update_curves();
  bool is_sender(const Source& source, std::size_t callback) const;
  SegmentBound bound(const std::vector<std::size_t>& callbacks,
                     const std::size_t* predecessor) const;
  bool is_inside(std::size_t from, const Output& output) const {
    return parts_[system_.callbacks[from].executor].is_inside(from, output);
  }
  template <class Function>
  void for_each_sender(const Output& output, const Function& function) const;
  Time sent_after(std::size_t from, const Output& output) const;
  Time longest_gap(std::size_t from, const Output& output) const;
  Time wait_of_join(std::size_t from, Time own_gap, const Output& output) const;
  Time next_end(std::size_t callback) const;
  bool may_lose_before(std::size_t callback) const;

  const System& system_;
  const Time limit_;
  struct Applied {
    std::string name;
    std::unique_ptr<Method> method;
    MethodTraits traits;
  };
  std::vector<Applied> methods_;
  std::vector<std::size_t> ordered_;  // callbacks, senders first
  std::vector<Part> parts_;           // by executor; supplies and paths refer to them
  std::vector<AnalysedPath> paths_;   // of all, shorter ones before what they begin
};

}  // namespace analysis
}  // namespace takt

#endif  // TAKT_ANALYSIS_SOLVER_HPP_
