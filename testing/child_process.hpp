// A test in a process of its own, with or without rights.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_CHILD_PROCESS_HPP_
#define TAKT_TESTING_CHILD_PROCESS_HPP_

#include <functional>
#include <string>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace takt {

enum class Rights { as_they_are, none };
inline constexpr const char* kCannotDrop = "cannot drop rights";

/// Runs `body` in a child process and returns its text. On request the child has no right to a
/// real-time policy or to locked memory; returns kCannotDrop if the rights cannot be dropped.
inline std::string in_child(Rights rights, const std::function<std::string()>& body) {
  int channel[2];
  EXPECT_EQ(pipe(channel), 0);
  const pid_t child = fork();
  if (child == 0) {
    close(channel[0]);
    bool ready = true;
    if (rights == Rights::none) {
      const rlimit none{0, 0};
      for (const auto limit : {RLIMIT_RTPRIO, RLIMIT_NICE, RLIMIT_MEMLOCK}) {
        setrlimit(limit, &none);
      }
      // The change from root to nobody drops all capabilities.
      ready = getuid() != 0 || setuid(65534) == 0;
    }
    const std::string text = ready ? body() : kCannotDrop;
    const bool sent = write(channel[1], text.data(), text.size()) >= 0;
    _exit(sent ? 0 : 1);
  }
  close(channel[1]);
  std::string text;
  char buffer[256];
  for (ssize_t size; (size = read(channel[0], buffer, sizeof buffer)) > 0;) {
    text.append(buffer, static_cast<std::size_t>(size));
  }
  close(channel[0]);
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "status " << status;
  return text;
}

}  // namespace takt

#endif  // TAKT_TESTING_CHILD_PROCESS_HPP_
