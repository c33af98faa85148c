// SPDX-License-Identifier: Apache-2.0
#include "takt/base/library_trial.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include <elf.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <link.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/clock.hpp"
#include "takt/base/error.hpp"
#include "takt/base/library.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/regular_file.hpp"

namespace takt {
namespace {

namespace fs = std::filesystem;

// ---- Looking ----

constexpr int kClass = sizeof(void*) == 8 ? ELFCLASS64 : ELFCLASS32;

[[noreturn]] void cut_off(std::uint64_t size) {
  throw Error(fmt::format("it is cut off: its headers promise more than its {} bytes", size),
              "build it, or copy it, again");
}

// Throws Error unless [offset, offset + bytes) lies in the file.
void check_range(const RegularFile& file, std::uint64_t offset, std::uint64_t bytes) {
  if (offset > file.size() || bytes > file.size() - offset) cut_off(file.size());
}

// A table of headers.
template <class Entry>
std::vector<Entry> read_table(const RegularFile& file, std::uint64_t offset, std::size_t count) {
  check_range(file, offset, count * sizeof(Entry));
  std::vector<Entry> table(count);
  const auto bytes = std::as_writable_bytes(std::span(table));
  if (file.read(offset, bytes) != bytes.size()) cut_off(file.size());
  return table;
}

/// The text at this offset of the ELF string table, cut to the longest name of a library.
std::string text_at(const RegularFile& file, std::uint64_t offset) {
  std::array<char, 256> text{};
  file.read(offset, std::as_writable_bytes(std::span(text).first(text.size() - 1)));
  return text.data();
}

// The place in the file of an address of the loaded library; 0: the file does not contain it.
std::uint64_t offset_of(std::uint64_t address, const std::vector<ElfW(Phdr)>& parts) {
  for (const auto& part : parts) {
    if (part.p_type == PT_LOAD && address - part.p_vaddr < part.p_filesz) {
      return address - part.p_vaddr + part.p_offset;
    }
  }
  return 0;
}

// In a sourced ROS 2 shell, dlopen of a ROS 2 component succeeds, and brings in a second
// middleware.
void check_needed(const RegularFile& file, const std::vector<ElfW(Phdr)>& parts) {
  const auto found = std::find_if(parts.begin(), parts.end(),
                                  [](const auto& part) { return part.p_type == PT_DYNAMIC; });
  if (found == parts.end()) return;
  const auto entries =
      read_table<ElfW(Dyn)>(file, found->p_offset, found->p_filesz / sizeof(ElfW(Dyn)));
  std::uint64_t texts = 0;
  for (const auto& entry : entries) {
    if (entry.d_tag == DT_STRTAB) texts = offset_of(entry.d_un.d_ptr, parts);
  }
  for (const auto& entry : entries) {
    if (entry.d_tag != DT_NEEDED || texts == 0) continue;
    const std::string name = text_at(file, texts + entry.d_un.d_val);
    if (!name.starts_with("librclcpp")) continue;
    throw Error(fmt::format("it is built against rclcpp: it needs {}", name),
                "build its source against Takt (docs/how_to/port_from_rclcpp.md)");
  }
}

void check_elf(const RegularFile& file) {
  ElfW(Ehdr) head{};
  if (file.read(0, std::as_writable_bytes(std::span(&head, 1))) != sizeof head ||
      std::memcmp(head.e_ident, ELFMAG, SELFMAG) != 0 || head.e_ident[EI_CLASS] != kClass) {
    return;
  }
  std::vector<ElfW(Phdr)> parts;
  if (head.e_phentsize == sizeof(ElfW(Phdr))) {
    parts = read_table<ElfW(Phdr)>(file, head.e_phoff, head.e_phnum);
    for (const auto& part : parts) {
      if (part.p_type != PT_NULL) check_range(file, part.p_offset, part.p_filesz);
    }
  }
  // Section headers come last in the file, so a cut-off file lacks them first. A stripped library
  // may have none.
  if (head.e_shoff != 0 && head.e_shentsize == sizeof(ElfW(Shdr))) {
    for (const auto& part : read_table<ElfW(Shdr)>(file, head.e_shoff, head.e_shnum)) {
      if (part.sh_type == SHT_NULL || part.sh_type == SHT_NOBITS) continue;
      check_range(file, part.sh_offset, part.sh_size);
    }
  }
  check_needed(file, parts);
}

// ---- Trying ----

// Limit: time that a process that has loaded a library may take to end. At it: it is killed, and
// counts as one that ends well. Seen: nothing.
constexpr std::chrono::seconds kMostOfEnd(1);

/// A process that runs the program takt_try_library.
class Trial {
 public:
  Trial(const std::string& program, const std::string& takt, const std::string& library) {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw Error("no pipe: " + errno_message(errno));
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&files, ends[1], STDERR_FILENO);
    posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    // The process does not inherit this thread's signals and real-time policy.
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    const sched_param ordinary{};
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setschedpolicy(&attributes, SCHED_OTHER);
    posix_spawnattr_setschedparam(&attributes, &ordinary);
    posix_spawnattr_setflags(
        &attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSCHEDULER);
    std::array<std::string, 3> words{program, takt, library};
    std::array<char*, 4> argv{words[0].data(), words[1].data(), words[2].data(), nullptr};
    // Not fork: after a fork, each page that a real-time thread writes to faults once.
    const int error =
        posix_spawn(&pid_, program.c_str(), &files, &attributes, argv.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    close(ends[1]);
    output_ = ends[0];
    if (error != 0) {
      close(output_);
      throw Error("no process: " + errno_message(error));
    }
  }
  ~Trial() {
    if (!status_) reap();
    close(output_);
  }
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;

  /// Waits until the library is loaded or the process has ended. False: the time was up before.
  bool wait(TimePoint end) {
    while (!is_loaded_) {
      if (Clock::steady().now() >= end) return false;
      if (!read(end)) {
        reap();
        return true;
      }
    }
    return true;
  }
  /// The process writes a zero byte when all initialisers have returned.
  bool is_loaded() const { return is_loaded_; }
  /// False: a signal other than our SIGKILL ended the process after it had loaded the library. A
  /// process that does not end in time is killed, and counts as one that ends well.
  bool ends_well(TimePoint limit) {
    while (Clock::steady().now() < limit && read(limit)) {
    }
    reap();
    return !WIFSIGNALED(*status_) || WTERMSIG(*status_) == SIGKILL;
  }
  /// "was ended by signal 6 (Aborted): terminate called …"
  std::string end() const {
    const int status = status_.value_or(0);
    std::string end = WIFSIGNALED(status)
                          ? fmt::format("was ended by signal {} ({})", WTERMSIG(status),
                                        sigdescr_np(WTERMSIG(status)))
                          : fmt::format("has ended with status {}", WEXITSTATUS(status));
    std::string said = text_.substr(text_.size() - std::min(text_.size(), kMostText));
    std::erase(said, '\0');
    while (!said.empty() && said.back() == '\n') said.pop_back();
    std::replace(said.begin(), said.end(), '\n', ' ');
    return said.empty() ? end : fmt::format("{}: {}", end, said);
  }

 private:
  // Limit: bytes of what a library prints while it is tried. At it: the last ones are kept. Seen:
  // nothing.
  static constexpr std::size_t kMostText = 1000;

  // Reads the next output of the process. False: the process has closed its output.
  bool read(TimePoint end) {
    const Nanoseconds left = std::max(Nanoseconds::zero(), end - Clock::steady().now());
    const timespec time{left / std::chrono::seconds(1), (left % std::chrono::seconds(1)).count()};
    pollfd readable{output_, POLLIN, 0};
    if (ppoll(&readable, 1, &time, nullptr) <= 0) return true;
    std::array<char, 4096> buffer;
    const ssize_t size = ::read(output_, buffer.data(), buffer.size());
    if (size < 0 && errno == EINTR) return true;
    if (size <= 0) return false;
    text_.append(buffer.data(), static_cast<std::size_t>(size));
    is_loaded_ |= text_.find('\0') != text_.npos;
    if (text_.size() > 2 * kMostText) text_.erase(0, text_.size() - kMostText);
    return true;
  }

  // An ended process keeps its status; one that only closed its output is killed.
  void reap() {
    kill(pid_, SIGKILL);
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0) {
      if (errno == EINTR) continue;
      break;  // the program ignores SIGCHLD, or waits for all of its children itself
    }
    status_ = status;
  }

  pid_t pid_ = -1;
  int output_ = -1;
  std::string text_;
  bool is_loaded_ = false;
  std::optional<int> status_;
};

}  // namespace

void check_library_file(const std::string& path) {
  if (std::error_code none; !fs::exists(path, none)) return;
  check_elf(RegularFile(path));
}

void try_library(const std::string& path, Nanoseconds limit) {
  const fs::path takt = path_of_takt();
  const fs::path program = takt.parent_path() / "takt" / "takt_try_library";
  if (access(program.c_str(), X_OK) != 0) {
    static std::atomic<bool> is_said = false;
    if (!is_said.exchange(true)) {
      log(LogLevel::warn,
          "libraries are loaded untried: there is no program '{}'; install Takt whole",
          program.string());
    }
    return;
  }
  Trial trial(program, takt, path);
  if (!trial.wait(later(Clock::steady().now(), limit))) {
    throw Error(fmt::format("a process that tried it was not done after {} s",
                            std::chrono::duration<double>(limit).count()),
                "its static initialisers must return");
  }
  if (trial.is_loaded()) {
    if (trial.ends_well(later(Clock::steady().now(), kMostOfEnd))) return;
    throw Error("a process that has loaded it " + trial.end(),
                "its static destructors must return, and not crash");
  }
  throw Error("a process that tried it " + trial.end(),
              "its static initialisers must return, and throw nothing");
}

}  // namespace takt
