// takt bundle: opens a comparison that someone has published, and repeats it.
// SPDX-License-Identifier: Apache-2.0
#include "bundle/bundle.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/version.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "table.hpp"

namespace takt::tools::bundle_command {
namespace {

struct Options {
  std::string bundle, folder;
  bool runs = false, runs_as_root = false;
};

void print(const std::vector<BundledFile>& files) {
  Table table({"file", "bytes"});
  for (const BundledFile& file : files) table.add({file.path, std::to_string(file.content.size())});
  table.print("files");
  const std::string version = version_of(files);
  rt::print("\nmade by Takt {}; this is {}\n", version.empty() ? "?" : printable(version),
            TAKT_VERSION);
  const auto script = std::find_if(files.begin(), files.end(),
                                   [](const BundledFile& file) { return file.path == kRunScript; });
  rt::print("\nits script `{}`:\n\n{}", kRunScript, printable(script->content, Lines::keep));
}

/// This process becomes the script, which uses this program.
[[noreturn]] void become_script(const std::string& folder) {
  const std::string script = std::filesystem::absolute(folder) / kRunScript;
  setenv("TAKT", std::filesystem::read_symlink("/proc/self/exe").c_str(), 1);
  execl(script.c_str(), script.c_str(), nullptr);
  throw Error("the script cannot be run: " + errno_message(errno), "see its first line", script);
}

void open_bundle(const Options& options) {
  if (options.runs && geteuid() == 0 && !options.runs_as_root) {
    throw Error("this is root, and a bundle runs what someone else has written",
                "run it as another user, or add --as-root", options.bundle);
  }
  const std::vector<BundledFile> files = read_bundle(options.bundle);
  const std::string folder =
      options.folder.empty() ? folder_of_bundle(options.bundle) : options.folder;
  extract(files, folder);
  print(files);
  if (!options.runs)
    return rt::print("\n'{0}' has these files; nothing was run. {0}/{1} does it.\n", folder,
                     kRunScript);
  rt::print("\n");
  std::fflush(stdout);
  become_script(folder);
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  command->add_option("BUNDLE", options->bundle, "A file of `takt compare --bundle`")->required();
  command->add_option("--into", options->folder,
                      "The new folder for its files (default: the bundle's name)");
  CLI::Option* const runs = command->add_flag("--run", options->runs,
                                              "Then run its script, which repeats the comparison");
  command->add_flag("--as-root", options->runs_as_root, "Run it also as root")->needs(runs);
  command->footer(
      "Nothing of a bundle runs unless --run says so; its script is shown before.\n\n"
      "Example:\n  takt bundle robot.tar.zst\n  takt bundle robot.tar.zst --into again --run\n");
  command->callback([options] { open_bundle(*options); });
}
const Command registered("bundle", "Opens a published comparison, and repeats it", set_up);

}  // namespace
}  // namespace takt::tools::bundle_command
