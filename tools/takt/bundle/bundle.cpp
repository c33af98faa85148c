// SPDX-License-Identifier: Apache-2.0
#include "bundle/bundle.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <stdexcept>
#include <string_view>

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>
#include <locale.h>
#include <nlohmann/json.hpp>
#include <openssl/evp.h>
#include <sys/stat.h>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/base/version.hpp"
#include "takt/measuring/json_text.hpp"

namespace takt::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Limit: bytes of a bundle, and of what is in it. At it: neither made nor opened. Seen: the error.
constexpr std::size_t kMostBytes = std::size_t{256} << 20;
// Limit: files in a bundle. At it: it is not opened. Seen: the error.
constexpr std::size_t kMostFiles = 1000;
constexpr std::size_t kLongestName = 200;
constexpr std::size_t kLongestVersion = 40;  // of it more is not shown

[[noreturn]] void refuse_bundle(const std::string& path, const std::string& why) {
  throw Error(why, "ask its maker for another one; nothing was written", path);
}

std::string sha256(std::string_view content) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  if (EVP_Digest(content.data(), content.size(), digest, &length, EVP_sha256(), nullptr) != 1)
    throw std::runtime_error("OpenSSL has no SHA-256");
  std::string text;
  for (unsigned int i = 0; i < length; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

json about(const BundledFile& file) {
  return {{"bytes", file.content.size()}, {"sha256", sha256(file.content)}};
}

/// Relative, without "..", and of signs that a terminal and a shell leave alone.
bool is_plain(std::string_view path) {
  if (path.empty() || path.size() > kLongestName || printable(path) != path) return false;
  if (path.find_first_of("\\\n\t") != path.npos) return false;
  while (true) {
    const std::string_view part = path.substr(0, path.find('/'));
    if (part.empty() || part == "." || part == "..") return false;
    if (part.size() == path.size()) return true;
    path.remove_prefix(part.size() + 1);
  }
}

/// In which libarchive takes names as what they are, whatever the user's says.
class Utf8 {
 public:
  Utf8() : of_names_(newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr)), before_(uselocale(of_names_)) {}
  ~Utf8() {
    uselocale(before_);
    freelocale(of_names_);
  }
  Utf8(const Utf8&) = delete;
  Utf8& operator=(const Utf8&) = delete;

 private:
  const locale_t of_names_, before_;
};

struct Free {
  void operator()(archive* of) const { archive_free(of); }
  void operator()(archive_entry* of) const { archive_entry_free(of); }
};
using Archive = std::unique_ptr<archive, Free>;
using Entry = std::unique_ptr<archive_entry, Free>;

la_ssize_t append(archive*, void* to, const void* bytes, std::size_t size) {
  static_cast<std::string*>(to)->append(static_cast<const char*>(bytes), size);
  return static_cast<la_ssize_t>(size);
}

// The same files are the same bytes: nothing of the machine is in it.
void add(archive* to, const std::string& path, const BundledFile& file) {
  const Entry entry(archive_entry_new());
  archive_entry_set_pathname(entry.get(), path.c_str());
  archive_entry_set_filetype(entry.get(), AE_IFREG);
  archive_entry_set_perm(entry.get(), file.path == kRunScript ? 0755 : 0644);
  archive_entry_set_size(entry.get(), static_cast<la_int64_t>(file.content.size()));
  archive_entry_set_mtime(entry.get(), 0, 0);
  const auto size = static_cast<la_ssize_t>(file.content.size());
  if (archive_write_header(to, entry.get()) != ARCHIVE_OK ||
      archive_write_data(to, file.content.data(), file.content.size()) != size) {
    throw std::runtime_error(fmt::format("{}: {}", path, archive_error_string(to)));
  }
}

// Of an entry that a stranger may have made, with the room that is left.
BundledFile read_file(archive* from, archive_entry* entry, const std::string& path,
                      std::size_t room) {
  const char* const name = archive_entry_pathname(entry);
  if (name == nullptr || !is_plain(name))
    refuse_bundle(
        path, fmt::format("'{}' is no name of a file in a bundle", printable(name ? name : "")));
  if (archive_entry_filetype(entry) != AE_IFREG || archive_entry_hardlink(entry) != nullptr)
    refuse_bundle(path,
                  fmt::format("'{}' is no file: a bundle has no links, folders or devices", name));
  BundledFile file{name, {}};
  char block[1 << 16];
  while (const la_ssize_t count = archive_read_data(from, block, sizeof(block))) {
    if (count < 0) refuse_bundle(path, "it is damaged: " + printable(archive_error_string(from)));
    if (file.content.size() + static_cast<std::size_t>(count) > room)
      refuse_bundle(path, fmt::format("it has more than {} MiB", kMostBytes >> 20));
    file.content.append(block, static_cast<std::size_t>(count));
  }
  return file;
}

std::vector<BundledFile> read_files(const std::string& path) {
  const std::string bytes = read_text(path, kMostBytes);
  const Utf8 utf8;
  const Archive from(archive_read_new());
  archive_read_support_format_tar(from.get());
  archive_read_support_filter_zstd(from.get());
  if (archive_read_open_memory(from.get(), bytes.data(), bytes.size()) != ARCHIVE_OK)
    refuse_bundle(path, "this is no bundle of `takt compare`");
  std::vector<BundledFile> files;
  std::size_t room = kMostBytes;
  archive_entry* entry = nullptr;
  int status = ARCHIVE_OK;
  while ((status = archive_read_next_header(from.get(), &entry)) == ARCHIVE_OK) {
    if (files.size() == kMostFiles)
      refuse_bundle(path, fmt::format("it has more than {} files", kMostFiles));
    files.push_back(read_file(from.get(), entry, path, room));
    room -= files.back().content.size();
  }
  if (status != ARCHIVE_EOF)
    refuse_bundle(path, "it is damaged: " + printable(archive_error_string(from.get())));
  return files;
}

// All lie in one folder, which is theirs alone.
void leave_folder(std::vector<BundledFile>& files, const std::string& path) {
  const std::string folder = files.empty() ? "" : files[0].path.substr(0, files[0].path.find('/'));
  std::set<std::string> names;
  for (BundledFile& file : files) {
    if (!file.path.starts_with(folder + "/"))
      refuse_bundle(path, fmt::format("'{}' is outside of its folder '{}'", file.path, folder));
    file.path.erase(0, folder.size() + 1);
    if (!names.insert(file.path).second)
      refuse_bundle(path, fmt::format("it has '{}' twice", file.path));
  }
  for (const std::string& name : names) {
    for (std::size_t end = name.rfind('/'); end != name.npos; end = name.rfind('/', end - 1)) {
      if (end == 0) break;
      if (names.contains(name.substr(0, end)))
        refuse_bundle(path, fmt::format("'{}' is a file and a folder", name.substr(0, end)));
    }
  }
}

void check_manifest(const std::vector<BundledFile>& files, const std::string& path) {
  json wanted, found = json::object();
  bool has_script = false;
  for (const BundledFile& file : files) {
    has_script = has_script || file.path == kRunScript;
    if (file.path == kManifest) {
      wanted = rt::json_or_null(file.content);
    } else {
      found[file.path] = about(file);
    }
  }
  if (!wanted.is_object() || !has_script)
    refuse_bundle(path, fmt::format("it lacks '{}' or '{}'", kManifest, kRunScript));
  if (wanted.value("files", json()) == found) return;
  refuse_bundle(path, fmt::format("its files are not those that its {} lists", kManifest));
}

}  // namespace

void check_bundled_name(const std::string& path) {
  const bool is_ours = path == kManifest || path == kRunScript || path == kResults;
  if (is_plain(path) && path[0] != '-' && !is_ours) return;
  throw Error(fmt::format("'{}' is no name for a file in a bundle{}", printable(path),
                          is_ours ? ", which has one of its own" : ""),
              "rename it");
}

void write_bundle(const std::string& path, std::vector<BundledFile> files) {
  json manifest{{"takt", {{"version", TAKT_VERSION}}}, {"files", json::object()}};
  std::size_t bytes = 0;
  for (const BundledFile& file : files) {
    manifest["files"][file.path] = about(file);
    bytes += file.content.size();
  }
  if (bytes > kMostBytes || files.size() >= kMostFiles) {
    throw Error(
        fmt::format("a bundle has at most {} MiB and {} files", kMostBytes >> 20, kMostFiles),
        "bundle fewer files, or make fewer repeats", path);
  }
  files.push_back({kManifest, rt::json_text(manifest, 1) + "\n"});
  const Utf8 utf8;
  const Archive to(archive_write_new());
  archive_write_set_format_pax_restricted(to.get());
  archive_write_add_filter_zstd(to.get());
  archive_write_set_bytes_in_last_block(to.get(), 1);  // nothing behind what is compressed
  std::string compressed;
  archive_write_open(to.get(), &compressed, nullptr, append, nullptr);
  const std::string folder = folder_of_bundle(path);
  for (const BundledFile& file : files) add(to.get(), folder + "/" + file.path, file);
  if (archive_write_close(to.get()) != ARCHIVE_OK)
    throw std::runtime_error(fmt::format("{}: {}", path, archive_error_string(to.get())));
  OutputFile file(path, OutputFile::Whose::unmarked);
  file.write(compressed);
  file.complete();
}

std::vector<BundledFile> read_bundle(const std::string& path) {
  std::vector<BundledFile> files = read_files(path);
  leave_folder(files, path);
  check_manifest(files, path);
  return files;
}

std::string version_of(const std::vector<BundledFile>& files) {
  for (const BundledFile& file : files) {
    if (file.path != kManifest) continue;
    const json made = rt::json_or_null(file.content).value("takt", json());
    const json version = made.is_object() ? made.value("version", json()) : json();
    return version.is_string() ? version.get<std::string>().substr(0, kLongestVersion) : "";
  }
  return "";
}

std::string folder_of_bundle(const std::string& path) {
  std::string name = fs::path(path).filename();
  const std::size_t end = name.find(".tar");
  return end == 0 || end == name.npos ? name + ".files" : name.substr(0, end);
}

void extract(const std::vector<BundledFile>& files, const std::string& folder) {
  if (mkdir(folder.c_str(), 0755) != 0) {
    const int error = errno;
    throw Error("the folder cannot be made: " + errno_message(error),
                "name one that is not there, with --into", folder);
  }
  for (const BundledFile& file : files) {
    fs::create_directories((fs::path(folder) / file.path).parent_path());
    OutputFile to(FilePlace(folder, file.path), OutputFile::Whose::person);
    to.write(file.content);
    to.complete();
    fs::permissions(fs::path(folder) / file.path, fs::perms(file.path == kRunScript ? 0755 : 0644));
  }
}

}  // namespace takt::tools
