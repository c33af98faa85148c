// A peer process that executes commands line by line.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_PEER_PROCESS_HPP_
#define TAKT_TESTING_PEER_PROCESS_HPP_

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/testing/eventually.hpp"

namespace takt {

/// A domain that no other test has while this process lives, see cmake/checks.py, which chooses
/// likewise. Up to 100: the ports of larger ones lie where Linux gives out ephemeral ports.
inline int test_domain() {
  static const int domain = [] {
    for (int i = 0; i < 100; ++i) {
      const int candidate = 1 + (getpid() + i) % 100;
      const std::string lock =
          "/tmp/takt_test_domain_" + std::to_string(getuid()) + "_" + std::to_string(candidate);
      const int file = open(lock.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600);
      if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0) return candidate;  // stays open
      close(file);
    }
    throw Error("all domains for tests are taken", "wait until other tests have ended");
  }();
  return domain;
}

/// Resources of a process, which must not grow while other processes come and go.
struct Footprint {
  std::size_t files = 0;
  long memory_kb = 0;  // of its own, not shared
};
inline Footprint footprint(pid_t pid) {
  Footprint result;
  const std::string process = "/proc/" + std::to_string(pid);
  for ([[maybe_unused]] const auto& file : std::filesystem::directory_iterator(process + "/fd")) {
    ++result.files;
  }
  std::ifstream status(process + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("RssAnon:")) result.memory_kb = std::stol(line.substr(8));
  }
  return result;
}
/// Duration of fault tests; TAKT_FAULT_SECONDS overrides it.
inline std::chrono::seconds fault_time() {
  const char* seconds = std::getenv("TAKT_FAULT_SECONDS");
  return std::chrono::seconds(seconds != nullptr ? std::atoi(seconds) : 4);
}

inline void expect_flat([[maybe_unused]] const Footprint& before,
                        [[maybe_unused]] const Footprint& after) {
  // The thread sanitizer opens two pipes to a program that finds the names of functions.
#if !defined(__SANITIZE_THREAD__)
  EXPECT_EQ(after.files, before.files);
#endif
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // which keep what is freed
  // Of a reader that was killed Cyclone keeps what it has not confirmed until its lease ends: grows
  // for two minutes where many are killed, by 5 MB.
  const long growth_kb = fault_time() > std::chrono::seconds(10) ? 8192 : 2048;
  EXPECT_LT(after.memory_kb, before.memory_kb + growth_kb);
#endif
}

/// The destructor ends the process and waits for it.
class PeerProcess {
 public:
  /// Sends `first_line` to the program, and expects the response `greeting`.
  PeerProcess(const char* program, const std::string& first_line) {
    signal(SIGPIPE, SIG_IGN);  // writing to a killed peer must not end the test
    std::array<int, 2> to{}, from{};
    // Other peers must not inherit the pipes and keep them open.
    if (pipe2(to.data(), O_CLOEXEC) != 0 || pipe2(from.data(), O_CLOEXEC) != 0) {
      throw Error("cannot create pipes");
    }
    pid_ = fork();
    if (pid_ == 0) {
      dup2(to[0], STDIN_FILENO);
      dup2(from[1], STDOUT_FILENO);
      execl(program, program, nullptr);
      _exit(127);
    }
    close(to[0]);
    close(from[1]);
    commands_ = fdopen(to[1], "w");
    answers_ = fdopen(from[0], "r");
    greeting_ = ask(first_line);
  }
  ~PeerProcess() {
    end();
    fclose(answers_);
    int status = 0;
    waitpid(pid_, &status, 0);
    // Another status is a sanitizer's, which has said why. A signal is the test's own kill, or,
    // with the address sanitizer, iceoryx's abort at an exit with empty pools.
    EXPECT_TRUE(!WIFEXITED(status) || WEXITSTATUS(status) == 0) << "of a peer: " << status;
  }
  PeerProcess(const PeerProcess&) = delete;
  PeerProcess& operator=(const PeerProcess&) = delete;

  pid_t pid() const noexcept { return pid_; }
  const std::string& greeting() const noexcept { return greeting_; }
  std::string ask(const std::string& command) const {
    std::fprintf(commands_, "%s\n", command.c_str());
    std::fflush(commands_);
    std::array<char, 400> answer{};
    if (std::fgets(answer.data(), answer.size(), answers_) == nullptr) return "dead";
    std::string text(answer.data());
    while (text.ends_with('\n')) text.pop_back();
    return text;
  }
  /// Says that nothing more comes, at which it ends.
  void end() {
    if (commands_ != nullptr) fclose(std::exchange(commands_, nullptr));
  }
  /// Ends the process; returns false if it did not end in time and was killed.
  bool ends() {
    end();
    siginfo_t info{};
    const bool has_ended = eventually([&] {
      return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOWAIT | WNOHANG) == 0 &&
             info.si_pid == pid_;
    });
    if (!has_ended) kill();
    return has_ended;
  }
  void kill() const { ::kill(pid_, SIGKILL); }
  /// Returns when none of its threads runs any more.
  void stop() const {
    ::kill(pid_, SIGSTOP);
    waitpid(pid_, nullptr, WUNTRACED);
  }
  void resume() const { ::kill(pid_, SIGCONT); }

 private:
  pid_t pid_ = 0;
  FILE* commands_ = nullptr;
  FILE* answers_ = nullptr;
  std::string greeting_;
};

/// A peer that publishes to the test, and one that receives from it, which live and die together.
template <class Peer>
struct PeerPair {
  template <class... Args>
  explicit PeerPair(const Args&... args) : publisher(args...), subscriber(args...) {}
  void kill() {
    publisher.kill();
    subscriber.kill();
  }
  void stop() {
    publisher.stop();
    subscriber.stop();
  }
  void resume() {
    publisher.resume();
    subscriber.resume();
  }
  Peer publisher, subscriber;
};

}  // namespace takt

#endif  // TAKT_TESTING_PEER_PROCESS_HPP_
