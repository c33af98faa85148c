// Registries of classes that are chosen by name: executors, schedulers, components.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_REGISTRY_HPP_
#define TAKT_BASE_REGISTRY_HPP_

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/error.hpp"
#include "takt/base/visibility.hpp"

// A name that stands once in a file, for the macros that register: several files may be compiled as
// one. Two steps, because __COUNTER__ must be expanded before it is pasted.
#define TAKT_CONCATENATE(a, b) a##b
#define TAKT_CONCATENATE_EXPANDED(a, b) TAKT_CONCATENATE(a, b)
#define TAKT_UNIQUE(name) TAKT_CONCATENATE_EXPANDED(name, __COUNTER__)

namespace TAKT_PUBLIC takt {

/// Traits of products without properties.
struct NoTraits {};

/// Creates `Product`s by name, and gives their traits by name. A process has one registry for each
/// product. It is in libtakt, so libraries that are loaded later register in the same one.
/// Thread safety: every method may be called from any thread.
/// Real-time: no; names are resolved while a system is set up.
template <class Product, class Traits, class... Arguments>
class Registry {
 public:
  using Factory = std::function<std::unique_ptr<Product>(Arguments...)>;
  struct Entry {
    std::string description;
    Factory factory;
    Traits traits{};
  };

  /// `noun` is what errors call the product: "scheduler".
  explicit Registry(std::string noun) : noun_(std::move(noun)) {}

  const std::string& noun() const noexcept { return noun_; }

  void add(std::string name, Entry entry);

  std::unique_ptr<Product> make(std::string_view name, Arguments... arguments) const;

  /// Throws the error that lists the valid names when there is no such name.
  void check(std::string_view name) const { find(name); }

  std::vector<std::string> names() const;
  bool knows(std::string_view name) const {
    const std::lock_guard lock(mutex_);
    return entries_.contains(name);
  }

  std::string description(std::string_view name) const { return find(name).description; }
  Traits traits(std::string_view name) const { return find(name).traits; }

 private:
  Entry find(std::string_view name) const;

  const std::string noun_;
  mutable std::mutex mutex_;
  std::map<std::string, Entry, std::less<>> entries_;
};

// Not inline, so that a program compiles them only where no `extern template` says that libtakt has
// them.
template <class Product, class Traits, class... Arguments>
void Registry<Product, Traits, Arguments...>::add(std::string name, Entry entry) {
  const std::lock_guard lock(mutex_);
  const auto [known, is_new] = entries_.try_emplace(std::move(name), std::move(entry));
  if (!is_new) throw Error(noun_ + " '" + known->first + "' is registered twice");
}

template <class Product, class Traits, class... Arguments>
std::unique_ptr<Product> Registry<Product, Traits, Arguments...>::make(
    std::string_view name, Arguments... arguments) const {
  return find(name).factory(std::forward<Arguments>(arguments)...);
}

template <class Product, class Traits, class... Arguments>
std::vector<std::string> Registry<Product, Traits, Arguments...>::names() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> result;
  for (const auto& [name, entry] : entries_) result.push_back(name);
  return result;
}

template <class Product, class Traits, class... Arguments>
typename Registry<Product, Traits, Arguments...>::Entry
Registry<Product, Traits, Arguments...>::find(std::string_view name) const {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = entries_.find(name); found != entries_.end()) return found->second;
  }
  throw Error("no " + noun_ + " is called '" + std::string(name) + "'", suggest(name, names()));
}

}  // namespace takt

#endif  // TAKT_BASE_REGISTRY_HPP_
