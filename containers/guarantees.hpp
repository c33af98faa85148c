// Whether what runs in a container keeps its guarantees. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_GUARANTEES_HPP_
#define TAKT_CONTAINERS_GUARANTEES_HPP_

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/container_executors.hpp"
#include "takt/containers/set_callback_parameters.hpp"

namespace TAKT_INTERNAL takt {

/// The model of a container's process: which guarantees a change would break, and which executors
/// it would overload.
/// Thread safety: from any thread. Real-time: no.
class Guarantees {
 public:
  using Errors = std::vector<std::string>;
  using Changes = std::vector<std::pair<std::shared_ptr<Node>, CallbackParameterChanges>>;

  Guarantees(const ContainerSetting& setting, const ComponentList& components,
             const ContainerExecutors& executors)
      : setting_(setting), components_(components), executors_(executors) {}

  ModelledProcess modelled() const;
  /// By executor, of the callbacks that have a budget and a period; 1.0: one CPU. `more`: a
  /// component that is not in the list, and counts, too.
  std::map<std::string, double> utilisation(const Loaded* more = nullptr) const;
  /// An error for each executor whose callbacks need more CPU time than it has, whatever its
  /// scheduler.
  Errors too_much(const Loaded* more = nullptr) const;
  /// The chains that would not be guaranteed any more with this component, but are without it.
  Errors lost_by(const Loaded& loaded) const;
  /// The same, if the callbacks of these nodes get other parameters.
  Errors lost_by(const Changes& changes) const;

 private:
  void add_callbacks(const Loaded& loaded, ModelledProcess& process) const;
  Errors lost_by(const ModelledProcess& with, const std::string& how, const char* remedy) const;

  const ContainerSetting& setting_;
  const ComponentList& components_;
  const ContainerExecutors& executors_;
};

/// The callbacks of a component that is loaded, for the plan.
std::vector<Plan::Callback> callbacks_of(const std::shared_ptr<Node>& node);

}  // namespace takt

#endif  // TAKT_CONTAINERS_GUARANTEES_HPP_
