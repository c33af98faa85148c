// A comparison in one file, which another machine repeats: NAME.tar.zst.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_BUNDLE_HPP_
#define TAKT_TOOLS_TAKT_BUNDLE_HPP_

#include <string>
#include <vector>

namespace takt::tools {

struct BundledFile {
  std::string path;  // in the bundle
  std::string content;
};

/// Of the files of a bundle: what stands in it, and the script that repeats it.
inline constexpr const char* kManifest = "bundle.json";
inline constexpr const char* kRunScript = "run";
inline constexpr const char* kResults = "before.compared.json";  // see `takt compare --save`
inline constexpr const char* kBundleEnding = ".tar.zst";

/// Writes them, and a manifest with the size and the SHA-256 of each. Throws Error if they are too
/// large, and std::runtime_error if the file cannot be written; both name the path.
void write_bundle(const std::string& path, std::vector<BundledFile> files);

/// Reads a bundle of anyone. Throws Error, which names the path, if it is none, is too large, has
/// anything but files with plain relative names, or is not what its manifest says. The manifest
/// guards against accidents: it is of the maker of the bundle.
std::vector<BundledFile> read_bundle(const std::string& path);

/// Which version of Takt made the bundle, as its manifest says; empty: it does not.
std::string version_of(const std::vector<BundledFile>& files);

/// Throws Error for a path that no bundle has: one that leads out, or has signs that a terminal or
/// a shell would interpret, or begins with '-', or is that of a file that each bundle has.
void check_bundled_name(const std::string& path);

/// Its name without the ending: what it lies in, and is written to.
std::string folder_of_bundle(const std::string& path);

/// Writes them to a new folder. Throws Error if it is there, or cannot be made.
void extract(const std::vector<BundledFile>& files, const std::string& folder);

/// What a `takt compare` of these files needs besides Takt: the files, and the libraries that they
/// name or that register their components, with an index of these. Throws Error unless `takt check`
/// takes each with these files alone, or if two would have one name. `model`: another file; empty:
/// none.
std::vector<BundledFile> files_of_systems(const std::vector<std::string>& systems,
                                          const std::string& model);

/// The path of a file in a bundle.
std::string bundled(const std::string& file);

/// The script: `takt WORDS…` in the folder of the bundle, with its libraries.
std::string run_script(const std::vector<std::string>& words);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_BUNDLE_HPP_
