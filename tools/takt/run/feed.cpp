// SPDX-License-Identifier: Apache-2.0
#include "run/feed.hpp"

#include <array>
#include <cerrno>
#include <csignal>

#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt::tools {

int feed(std::vector<std::string> command, const std::string& input) {
  std::vector<char*> words;
  for (std::string& word : command) words.push_back(word.data());
  words.push_back(nullptr);
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw Error("cannot create a pipe: " + errno_message(errno));
  const pid_t child = fork();
  if (child < 0) throw Error("cannot create a process: " + errno_message(errno));
  if (child == 0) {
    dup2(ends[0], STDIN_FILENO);
    close(ends[0]);
    close(ends[1]);
    execvp(words[0], words.data());
    _exit(kNotInstalled);
  }
  close(ends[0]);
  const auto old = std::signal(SIGPIPE, SIG_IGN);
  for (std::size_t sent = 0; sent < input.size();) {
    const ssize_t size = write(ends[1], input.data() + sent, input.size() - sent);
    if (size <= 0) break;
    sent += static_cast<std::size_t>(size);
  }
  close(ends[1]);
  std::signal(SIGPIPE, old);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace takt::tools
