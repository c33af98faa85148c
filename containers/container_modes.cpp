// Checks the modes of a file against the callbacks that there are.
// SPDX-License-Identifier: Apache-2.0
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/containers/container_executors.hpp"
#include "takt/containers/container_plan.hpp"
#include "takt/sched/ranks.hpp"

namespace takt {
namespace {

bool may_be_dropped(const Entity& entity) {
  return entity.kind() == EntityKind::timer || entity.kind() == EntityKind::subscription;
}

bool may_overrun(const Plan::Callback& callback) {
  const CallbackParameters parameters = callback.node->callback_parameters(*callback.entity);
  return callback.entity->kind() == EntityKind::timer || parameters.budget || parameters.deadline;
}

/// For error texts. Leaves out schedulers that need keys of the file.
std::string schedulers_that_heed_demotion() {
  std::vector<std::string> names;
  for (const std::string& name : schedulers().names()) {
    if (schedulers().traits(name).keys.empty() && heeds_demotion(name)) names.push_back(name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

void check_demoted(ContainerSetting& setting, const ContainerExecutors& executors,
                   const ModeDescription& mode, const ModeDescription::Callback& listed,
                   const Plan::Callback& callback) {
  const RunningExecutor& running =
      executors.find(executors.name_for(*callback.node, *callback.entity->group()));
  if (!running.description.library.empty()) return;  // a library's executor may heed it
  const std::string scheduler = scheduler_of(running.description);
  if (heeds_demotion(scheduler, own_values_of(scheduler, setting.description))) return;
  const std::string what = fmt::format(
      "mode '{}' cannot demote '{}': executor '{}' has the order of '{}', which goes "
      "by no urgency",
      mode.name, listed.name, running.name, scheduler);
  const bool is_overridden =
      !setting.overrides.executor.empty() || !setting.overrides.scheduler.empty();
  if (is_overridden) return setting.note(what);  // a comparison shows what another order does
  setting.errors.push_back(
      Error(what, fmt::format("choose one of the schedulers {}", schedulers_that_heed_demotion()),
            listed.where)
          .what());
}

void lead_to_mode(ContainerSetting& setting, std::size_t mode, const Plan::Callback& callback) {
  const ModeDescription& described = setting.modes->all()[mode];
  if (!may_overrun(callback)) {
    setting.errors.push_back(
        Error(fmt::format("mode '{}': '{}' never overruns, as it has no budget and "
                          "no deadline",
                          described.name, described.on_overrun->name),
              "give it one of them", described.on_overrun->where)
            .what());
    return;
  }
  const CallbackParameters now = callback.node->callback_parameters(*callback.entity);
  callback.node->set_callback_parameters(
      {.callbacks = {
           {callback.entity->name(),
            {.on_deadline_miss = OverrunLeadsToMode{setting.modes, mode, now.on_deadline_miss},
             .on_overrun = OverrunLeadsToMode{setting.modes, mode, now.on_overrun}}}}});
}

}  // namespace

void prepare_modes(ContainerSetting& setting, const ComponentList& components,
                   const ContainerExecutors& executors) {
  const std::vector<ModeDescription>& modes = setting.modes->all();
  std::map<std::string, Plan::Callback> callbacks;
  std::vector<std::string> names;
  for (const Plan::Callback& callback : components.plan().callbacks) {
    // The resumption of a coroutine follows the mode of the coroutine.
    if (callback.entity->name().find("/resumed") != std::string::npos) continue;
    names.push_back(name_in_modes(callback.node, *callback.entity));
    callbacks.emplace(names.back(), callback);
  }
  const auto find = [&](const ModeDescription& mode, const ModeDescription::Callback& listed) {
    const auto found = callbacks.find(listed.name);
    if (found != callbacks.end()) return &found->second;
    setting.errors.push_back(
        Error(fmt::format("mode '{}': there is no callback '{}'", mode.name, listed.name),
              suggest(listed.name, names), listed.where)
            .what());
    return static_cast<Plan::Callback*>(nullptr);
  };
  for (std::size_t i = 1; i < modes.size(); ++i) {
    const ModeDescription& mode = modes[i];
    for (const ModeDescription::Callback& listed : mode.drop) {
      const Plan::Callback* const callback = find(mode, listed);
      if (callback == nullptr || may_be_dropped(*callback->entity)) continue;
      setting.errors.push_back(
          Error(fmt::format("mode '{}' cannot drop '{}', a {}: its clients would wait "
                            "for ever",
                            mode.name, listed.name, to_string(callback->entity->kind())),
                "demote it, or drop timers and subscriptions", listed.where)
              .what());
    }
    for (const ModeDescription::Callback& listed : mode.demote) {
      if (const Plan::Callback* const callback = find(mode, listed))
        check_demoted(setting, executors, mode, listed, *callback);
    }
    if (!mode.on_overrun) continue;
    if (const Plan::Callback* const callback = find(mode, *mode.on_overrun))
      lead_to_mode(setting, i, *callback);
  }
}

}  // namespace takt
