// What is known of each topic of a model. Private to the model's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_MODEL_TOPICS_HPP_
#define TAKT_CONTAINERS_MODEL_MODEL_TOPICS_HPP_

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "takt/analysis/arrival_curve.hpp"
#include "takt/containers/model/measured_model.hpp"
#include "takt/containers/model/system_model.hpp"

namespace takt {

/// A topic, and all that the file and the measured run say of what comes to it, whichever receiver
/// they say it of. It is true of each receiver: of each subscription of a topic, and of each server
/// of a service. A timer, a client and the like are alone on theirs.
struct ModelledTopic {
  std::vector<std::size_t> receivers;                         // callbacks
  const ModelledProcess::Callback* states_arrival = nullptr;  // from outside; nullptr: none does
  std::vector<const MeasuredCallback*> in_run;     // receivers that the model of the run has
  std::map<std::size_t, analysis::Count> at_once;  // by sender: most messages of one execution

  /// Whether the run has shown a message, or an execution of a receiver.
  bool was_received() const;
  /// Whether the run has shown one that no callback of its process has sent.
  bool has_uncaused() const;
  /// How many messages receivers lost in the run, if no receiver got them all; else 0.
  std::uint64_t lost_by_all() const;
};

/// Finds the topics of callbacks. Rules that are about messages read from here; what a run has
/// shown of one callback alone is how long it took, and how it waited.
/// Thread safety: none. Real-time: no.
class ModelTopics {
 public:
  ModelTopics() = default;
  /// `callbacks` and `measured`, with nullptr for those that the run does not have, have the same
  /// indices. Throws Error if receivers of a topic state different arrivals.
  ModelTopics(std::span<const ModelledProcess::Callback* const> callbacks,
              std::span<const MeasuredCallback* const> measured);

  const ModelledTopic& of(std::size_t callback) const { return all_[of_[callback]]; }
  const std::vector<ModelledTopic>& all() const noexcept { return all_; }
  /// The most messages that one execution of `from` sent to the topic of `to` in the run; nullopt:
  /// none was seen.
  std::optional<analysis::Count> at_once(std::size_t from, std::size_t to) const;
  /// The callbacks that send to this one, each as often as it has an output to it.
  const std::vector<std::size_t>& senders(std::size_t callback) const { return senders_[callback]; }
  /// To be called when outputs have changed.
  void find_senders(const analysis::System& system);

 private:
  std::vector<ModelledTopic> all_;
  std::vector<std::size_t> of_;                    // by callback
  std::vector<std::vector<std::size_t>> senders_;  // by callback
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_MODEL_MODEL_TOPICS_HPP_
