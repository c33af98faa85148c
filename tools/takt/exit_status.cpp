// SPDX-License-Identifier: Apache-2.0
#include "exit_status.hpp"

#include <csignal>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "outputs.hpp"
#include "run/end_signals.hpp"

namespace takt::tools {
namespace {

bool has_begun = false;

struct Row {
  int status;
  const char* means;
  const char* examples;
};
constexpr Row kTable[] = {
    {0, "It did what it was asked to do.",
     "Also when SIGINT (Ctrl-C) or SIGTERM ended in order what has no end of its own: `run`, "
     "`bag record`, `topic echo`. Also `--help` and `--version`."},
    {kFailed, "It ran, and something failed.",
     "A callback threw; a process of the run is missing at the end; rights were refused; a node "
     "did not answer, or was not found; a goal was rejected; a recording lacks messages, as the "
     "disk was full; output could not be written; `analyze` found a chain without a guarantee, "
     "`simulate` one that misses its deadline, "
     "`doctor` a `BAD` setting, `selftest` a `WRONG` figure."},
    {kBadUsage, "Its words or its files are wrong; it has done nothing.",
     "An unknown option; an invalid file; a file that cannot be opened."},
    {128 + SIGINT, "SIGINT ended it before it was complete.",
     "A signal during the start, a second signal, or one to a command that ends by itself: "
     "`run --duration`, `compare`, `action send_goal`."},
    {128 + SIGTERM, "The same for SIGTERM.", "129 for SIGHUP, which closing a terminal sends."},
};

}  // namespace

void begin_work() {
  if (!has_begun) check_chosen_outputs();  // what the command reads is known
  has_begun = true;
}

int status_of_error() noexcept {
  return has_begun ? kFailed : kBadUsage;
}

std::string message_of(const std::exception& error) {
  if (dynamic_cast<const nlohmann::json::exception*>(&error) != nullptr) {  // in no words of people
    return "data of another process, or of a file that Takt has written, are not of the form that "
           "this version of Takt has; run it again, and report it if it stays so";
  }
  const auto* const of_system = dynamic_cast<const std::system_error*>(&error);
  const bool is_thread =
      of_system != nullptr && of_system->code() == std::errc::resource_unavailable_try_again;
  return std::string(error.what()) +
         (is_thread ? ": no thread could be started; raise the limit (ulimit -u, -v)" : "");
}

Interrupted::Interrupted(int signal_number, const std::string& when)
    : runtime_error(name_of_signal(signal_number) + " came" + when), signal(signal_number) {
}

void check_complete(int signal, bool ends_by_itself) {
  if (signal != 0 && ends_by_itself) throw Interrupted(signal, " before the end");
}

std::string exit_status_page() {
  std::string page =
      "# Exit statuses\n\n"
      "Each status says the same in every command. `takt help exit-status` prints this page.\n\n"
      "| status | what it says | for example |\n|---|---|---|\n";
  for (const Row& row : kTable) {
    page += fmt::format("| {} | {} | {} |\n", row.status, row.means, row.examples);
  }
  return page;
}

}  // namespace takt::tools
