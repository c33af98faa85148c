// SPDX-License-Identifier: Apache-2.0
#include "report.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <fstream>

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"

#include "embedded.hpp"

namespace takt::tools {
namespace {

constexpr const char* kPython = "/usr/bin/python3";  // Debian's Python finds Debian's matplotlib

/// Runs the script with the text as its input, and returns its exit status.
int run_python(const std::string& script, const std::string& argument, const std::string& input) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw Error("cannot create a pipe: " + errno_message(errno));
  const pid_t child = fork();
  if (child < 0) throw Error("cannot create a process: " + errno_message(errno));
  if (child == 0) {
    dup2(ends[0], STDIN_FILENO);
    close(ends[0]);
    close(ends[1]);
    execl(kPython, kPython, "-c", script.c_str(), argument.c_str(), nullptr);
    _exit(127);
  }
  close(ends[0]);
  const auto old = std::signal(SIGPIPE, SIG_IGN);  // the script may end before it has read all
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

}  // namespace

void check_report(const std::string& path) {
  if (run_python("import matplotlib", "", "") != 0) {
    throw Error("--report needs Python's matplotlib, which is not installed",
                "run `apt-get install python3-matplotlib`, or omit --report");
  }
  if (!std::ofstream(path, std::ios::app)) {
    throw Error("the report cannot be written", "choose a writable file", path);
  }
}

void write_report(const nlohmann::json& document, const std::string& path) {
  if (run_python(kReportScript, path, rt::json_text(document)) != 0) {
    throw std::runtime_error(path + ": the report was not drawn; see the message above");
  }
  rt::to_stderr("report: {}\n", path);
}

}  // namespace takt::tools
