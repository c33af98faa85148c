// SPDX-License-Identifier: Apache-2.0
#include "bundle/archive.hpp"

#include <memory>
#include <stdexcept>

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>
#include <locale.h>

#include "takt/base/printable.hpp"

namespace takt::tools {
namespace {

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

void add(archive* to, const BundledFile& file) {
  const Entry entry(archive_entry_new());
  archive_entry_set_pathname(entry.get(), file.path.c_str());
  archive_entry_set_filetype(entry.get(), AE_IFREG);
  archive_entry_set_perm(entry.get(),
                         file.path.ends_with(std::string("/") + kRunScript) ? 0755 : 0644);
  archive_entry_set_size(entry.get(), static_cast<la_int64_t>(file.content.size()));
  archive_entry_set_mtime(entry.get(), 0, 0);
  const auto size = static_cast<la_ssize_t>(file.content.size());
  if (archive_write_header(to, entry.get()) != ARCHIVE_OK ||
      archive_write_data(to, file.content.data(), file.content.size()) != size) {
    throw std::runtime_error(fmt::format("{}: {}", file.path, archive_error_string(to)));
  }
}

std::string pack(const std::vector<BundledFile>& files, const std::string& path) {
  const Utf8 utf8;
  const Archive to(archive_write_new());
  archive_write_set_format_pax_restricted(to.get());
  archive_write_add_filter_zstd(to.get());
  archive_write_set_bytes_in_last_block(to.get(), 1);  // nothing behind what is compressed
  std::string compressed;
  archive_write_open(to.get(), &compressed, nullptr, append, nullptr);
  for (const BundledFile& file : files) add(to.get(), file);
  if (archive_write_close(to.get()) != ARCHIVE_OK)
    throw std::runtime_error(fmt::format("{}: {}", path, archive_error_string(to.get())));
  return compressed;
}

// Of an entry that a stranger may have made, with the room that is left.
BundledFile read_file(archive* from, archive_entry* entry, const std::string& path,
                      std::size_t room) {
  const char* const name = archive_entry_pathname(entry);
  BundledFile file{name != nullptr ? name : "", {}};
  if (archive_entry_filetype(entry) != AE_IFREG || archive_entry_hardlink(entry) != nullptr)
    refuse_bundle(path, fmt::format("'{}' is no file: a bundle has no links, folders or devices",
                                    printable(file.path)));
  char block[1 << 16];
  while (const la_ssize_t count = archive_read_data(from, block, sizeof(block))) {
    if (count < 0) refuse_bundle(path, "it is damaged: " + printable(archive_error_string(from)));
    if (file.content.size() + static_cast<std::size_t>(count) > room)
      refuse_bundle(path, fmt::format("it has more than {} MiB", kMostBytes >> 20));
    file.content.append(block, static_cast<std::size_t>(count));
  }
  return file;
}

std::vector<BundledFile> unpack(const std::string& bytes, const std::string& path) {
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

}  // namespace
}  // namespace takt::tools

extern "C" __attribute__((visibility("default")))
const takt::tools::Archives takt_archives = {takt::tools::pack, takt::tools::unpack};
