// The modes of a container: which callbacks they are about, and how they come into force.
// SPDX-License-Identifier: Apache-2.0
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/container_parts.hpp"
#include "takt/containers/modes.hpp"
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

/// For errors: those that need no keys of the file.
std::string schedulers_that_heed_demotion() {
  std::vector<std::string> names;
  for (const std::string& name : schedulers().names()) {
    if (schedulers().traits(name).keys.empty() && heeds_demotion(name)) names.push_back(name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

// The components are made, and no executor has their callbacks yet.
void Container::prepare_modes() {
  std::map<std::string, Plan::Callback> callbacks;
  std::vector<std::string> names;
  for (const Plan::Callback& callback : plan().callbacks) {
    if (callback.entity->name().find("/resumed") != std::string::npos) continue;  // it follows
    names.push_back(name_in_modes(callback.node, *callback.entity));
    callbacks.emplace(names.back(), callback);
  }
  const auto find = [&](const ModeDescription& mode, const ModeDescription::Callback& listed) {
    const auto found = callbacks.find(listed.name);
    if (found != callbacks.end()) return &found->second;
    errors_.push_back(
        Error(fmt::format("mode '{}': there is no callback '{}'", mode.name, listed.name),
              suggest(listed.name, names), listed.where)
            .what());
    return static_cast<Plan::Callback*>(nullptr);
  };
  for (std::size_t i = 1; i < modes_->all().size(); ++i) {
    const ModeDescription& mode = modes_->all()[i];
    for (const ModeDescription::Callback& listed : mode.drop) {
      const Plan::Callback* const callback = find(mode, listed);
      if (callback == nullptr || may_be_dropped(*callback->entity)) continue;
      errors_.push_back(
          Error(fmt::format("mode '{}' cannot drop '{}', a {}: its clients would wait "
                            "for ever",
                            mode.name, listed.name, to_string(callback->entity->kind())),
                "demote it, or drop timers and subscriptions", listed.where)
              .what());
    }
    for (const ModeDescription::Callback& listed : mode.demote) {
      if (const Plan::Callback* const callback = find(mode, listed))
        check_demoted(mode, listed, *callback);
    }
    if (!mode.on_overrun) continue;
    if (const Plan::Callback* const callback = find(mode, *mode.on_overrun))
      lead_to_mode(i, *callback);
  }
}

void Container::check_demoted(const ModeDescription& mode, const ModeDescription::Callback& listed,
                              const Plan::Callback& callback) {
  const RunningExecutor& running =
      executor_for(executor_of(*callback.node, *callback.entity->group()));
  if (!running.description.library.empty()) return;  // it sees that, and decides itself
  const std::string scheduler = scheduler_of(running.description);
  if (heeds_demotion(scheduler, own_values_of(scheduler, description_))) return;
  const std::string what = fmt::format(
      "mode '{}' cannot demote '{}': executor '{}' has the order of '{}', which goes "
      "by no urgency",
      mode.name, listed.name, running.name, scheduler);
  const bool is_overridden = !overrides_.executor.empty() || !overrides_.scheduler.empty();
  if (is_overridden) return note(what);  // a comparison shows what another order does
  errors_.push_back(
      Error(what, fmt::format("choose one of the schedulers {}", schedulers_that_heed_demotion()),
            listed.where)
          .what());
}

void Container::lead_to_mode(std::size_t mode, const Plan::Callback& callback) {
  const ModeDescription& described = modes_->all()[mode];
  if (!may_overrun(callback)) {
    errors_.push_back(Error(fmt::format("mode '{}': '{}' never overruns, as it has no budget and "
                                        "no deadline",
                                        described.name, described.on_overrun->name),
                            "give it one of them", described.on_overrun->where)
                          .what());
    return;
  }
  const CallbackParameters now = callback.node->callback_parameters(*callback.entity);
  callback.node->set_callback_parameters(
      {.callbacks = {{callback.entity->name(),
                      {.on_deadline_miss = OverrunLeadsToMode{modes_, mode, now.on_deadline_miss},
                       .on_overrun = OverrunLeadsToMode{modes_, mode, now.on_overrun}}}}});
}

void Container::begin_in(const std::string& mode) {
  modes_->begin_in(mode);
  for (const auto& loaded : loaded_components()) serve_as_in_present_mode(loaded->node());
}

void Container::set_mode(const std::string& mode) {
  modes_->want(mode);
  switch_mode();
}

std::string Container::mode() const {
  return modes_->in_force();
}

void Container::switch_mode() {
  modes_->follow(*overrides_.clock, [this](std::size_t mode) {
    for (const auto& loaded : loaded_components()) serve_as_in(mode, loaded->node());
    changed("the mode has changed");
  });
}

void Container::serve_as_in_present_mode(const std::shared_ptr<Node>& node) {
  if (description_.modes.empty()) return;
  modes_->apply_present([&](std::size_t mode) { serve_as_in(mode, node); });
}

void Container::serve_as_in(std::size_t mode, const std::shared_ptr<Node>& node) {
  CallbackParameterChanges changes;
  for (const auto& entity : node->entities()) {
    const Serving before = node->callback_parameters(*entity).serving.value_or(Serving::usual);
    const Serving now = modes_->serving(mode, name_in_modes(node, *entity));
    if (now != before) changes.callbacks[entity->name()].serving = now;
  }
  if (!changes.callbacks.empty()) node->set_callback_parameters(changes);
}

}  // namespace takt
