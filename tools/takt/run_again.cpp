// SPDX-License-Identifier: Apache-2.0
#include "run_again.hpp"

#include <array>
#include <cerrno>

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt::tools {

nlohmann::json run_again(std::vector<std::string> words) {
  std::array<int, 2> pipe_ends{};
  if (pipe(pipe_ends.data()) != 0) throw Error("no pipe: " + errno_message(errno));
  const pid_t child = fork();
  if (child < 0) throw Error("no process: " + errno_message(errno));
  if (child == 0) {
    dup2(pipe_ends[1], STDOUT_FILENO);
    close(pipe_ends[0]);
    close(pipe_ends[1]);
    words.insert(words.begin(), "takt");
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    execv("/proc/self/exe", argv.data());
    _exit(127);
  }
  close(pipe_ends[1]);
  std::string text;
  std::array<char, 65536> buffer;
  for (ssize_t size; (size = read(pipe_ends[0], buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(size));
  }
  close(pipe_ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw Error(fmt::format("a run ended with status {}",
                            WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status)),
                "see its message above");
  }
  return nlohmann::json::parse(text);
}

}  // namespace takt::tools
