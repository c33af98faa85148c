// Libraries that a program loads by itself, and their functions.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCPPUTILS__SHARED_LIBRARY_HPP_
#define RCPPUTILS__SHARED_LIBRARY_HPP_

#include <stdexcept>
#include <string>

#include <dlfcn.h>
#include <link.h>

namespace rcpputils {

/// "libname.so"
inline std::string get_platform_library_name(std::string name, bool is_debug = false) {
  return "lib" + name + (is_debug ? "d" : "") + ".so";
}

/// A library that stays loaded until the process ends, as its callbacks and types may be in use.
/// Throws std::runtime_error when a library or symbol is not found.
/// Thread safety: not thread-safe. Real-time: set-up only.
class SharedLibrary {
 public:
  /// `path` is as for dlopen(3). Inline, because dlopen searches the run path of the library that
  /// calls it.
  explicit SharedLibrary(const std::string& path)
      : handle_(dlopen(path.c_str(), RTLD_LAZY | RTLD_NODELETE)) {
    if (handle_ == nullptr) {
      throw std::runtime_error("library '" + path + "' cannot be loaded: " + dlerror());
    }
  }
  virtual ~SharedLibrary() {
    if (handle_ != nullptr) dlclose(handle_);
  }
  SharedLibrary(const SharedLibrary&) = delete;
  SharedLibrary& operator=(const SharedLibrary&) = delete;

  /// From now on, no symbols can be looked up.
  void unload_library() {
    dlclose(handle());
    handle_ = nullptr;
  }
  void* get_symbol(const std::string& name) {
    void* const symbol = dlsym(handle(), name.c_str());
    if (symbol == nullptr) {
      throw std::runtime_error("library '" + get_library_path() + "' has no symbol '" + name + "'");
    }
    return symbol;
  }
  bool has_symbol(const std::string& name) { return dlsym(handle(), name.c_str()) != nullptr; }
  /// The path at which the library was found.
  std::string get_library_path() {
    link_map* map = nullptr;
    dlinfo(handle(), RTLD_DI_LINKMAP, &map);
    return map->l_name;
  }

 private:
  void* handle() const {
    if (handle_ == nullptr) throw std::runtime_error("the library has been unloaded");
    return handle_;
  }
  void* handle_;
};

}  // namespace rcpputils

#endif  // RCPPUTILS__SHARED_LIBRARY_HPP_
