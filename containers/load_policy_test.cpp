// Which libraries a container lets in, and what the file says about it.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/load_policy.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "takt/containers/configuration/configuration_file_test.hpp"

namespace takt {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;
using testing::ThrowsMessage;

// A folder of its own, without links above it.
class LoadPolicyTest : public testing::Test {
 protected:
  LoadPolicyTest() {
    std::string folder = testing::TempDir() + "takt_XXXXXX";
    if (mkdtemp(folder.data()) == nullptr) ADD_FAILURE() << "no directory " << folder;
    folder_ = fs::canonical(folder);
    for (const char* name : {"ours/below", "theirs", "ours_too"}) {
      fs::create_directories(folder_ / name);
      std::ofstream(folder_ / name / "lib.so") << "a library";
    }
    fs::create_symlink(folder_ / "theirs/lib.so", folder_ / "ours/disguised.so");
    fs::create_symlink(folder_ / "ours/below/lib.so", folder_ / "theirs/honest.so");
    fs::create_directory_symlink(folder_ / "theirs", folder_ / "ours/link");
    fs::create_symlink("round.so", folder_ / "ours/round.so");
  }
  ~LoadPolicyTest() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ / name; }
  // What would be loaded, without the folder; or the error.
  std::string outcome(const LoadPolicy& policy, const std::string& library) const {
    try {
      return fs::path(policy.permitted(library)).lexically_relative(folder_);
    } catch (const Error& error) {
      return error.what();
    }
  }

  fs::path folder_;
};

TEST_F(LoadPolicyTest, LetsInWhatLiesInAFolderOrBelowByItsRealPath) {
  const LoadPolicy policy{.folders = {real_folder(path("theirs/../ours"))}};
  EXPECT_EQ(outcome(policy, path("ours/below/lib.so")), "ours/below/lib.so");
  EXPECT_EQ(outcome(policy, path("ours/../ours/below//lib.so")), "ours/below/lib.so");
  EXPECT_EQ(outcome(policy, path("theirs/honest.so")), "ours/below/lib.so");
  for (const char* name : {"theirs/lib.so", "ours/disguised.so", "ours/link/lib.so",
                           "ours/../theirs/lib.so", "ours/below/../../theirs/lib.so",
                           "ours_too/lib.so", "ours/no/../../theirs/lib.so", "ours/round.so"}) {
    EXPECT_THAT(outcome(policy, path(name)), HasSubstr("may not be loaded")) << name;
  }
  EXPECT_EQ(outcome(policy, path("ours/$LIB")),
            "there is no library '" + path("ours/$LIB") + "'; name a shared library");
  EXPECT_EQ(outcome(policy, path("ours")),
            "there is no library '" + path("ours") + "'; name a shared library");
}

TEST_F(LoadPolicyTest, NamesTheKeyAndTheOptionThatWouldAllowIt) {
  EXPECT_EQ(outcome({}, path("ours/disguised.so")),
            "library '" + path("theirs/lib.so") +
                "' may not be loaded: neither the component index nor the container's file names "
                "it; allow its folder by `load: {libraries: [" +
                path("theirs") +
                "]}` under the container in its file, or by `takt run --name NAME --load " +
                path("theirs") + "`");
  EXPECT_THAT(outcome({}, "libm.so.6"), StartsWith("library 'libm.so.6' may not be loaded"));
  EXPECT_EQ(outcome({.kind = LoadPolicy::Kind::off}, path("ours/below/lib.so")),
            "this container loads no components on request; write `load: index` for it in its "
            "file, or use `takt run --name NAME --load index`");
  EXPECT_EQ(LoadPolicy{.kind = LoadPolicy::Kind::any}.permitted("libm.so.6"), "libm.so.6");
}

TEST_F(LoadPolicyTest, LetsInWhatTheFileNamesAndWhatTheIndexesName) {
  const LoadPolicy named{.libraries = {real_library(path("theirs/honest.so")), "libm.so.6"}};
  EXPECT_EQ(outcome(named, path("ours/below/lib.so")), "ours/below/lib.so");
  EXPECT_EQ(named.permitted("libm.so.6"), "libm.so.6");
  EXPECT_THAT(outcome(named, path("theirs/lib.so")), HasSubstr("may not be loaded"));

  for (const auto& [variable, folder] :
       {std::pair{"TAKT_COMPONENT_PATH", "share/takt/components"},
        std::pair{"AMENT_PREFIX_PATH", "share/ament_index/resource_index/rclcpp_components"}}) {
    fs::create_directories(folder_ / folder);
    std::ofstream(folder_ / folder / "guests") << "mine::Guest;theirs/honest.so\n";
    setenv(variable, ("/nowhere:" + folder_.string()).c_str(), 1);
    std::vector<std::string> found;
    for (const auto& [name, library] : component_index()) {
      if (name == "mine::Guest") found.push_back(library);
    }
    EXPECT_THAT(found, ElementsAre(path("theirs/honest.so"))) << variable;
    EXPECT_EQ(outcome({}, path("ours/below/lib.so")), "ours/below/lib.so") << variable;
    unsetenv(variable);
    EXPECT_THAT(outcome({}, path("ours/below/lib.so")), HasSubstr("may not be loaded"));
  }
}

// Everybody could put a library there, or a recording.
TEST_F(LoadPolicyTest, TakesNoFolderThatEverybodyCanChange) {
  fs::permissions(folder_ / "theirs", fs::perms::all);
  EXPECT_THAT([&] { parse_load_policy({path("theirs")}); },
              ThrowsMessage<Error>(HasSubstr("every user of this machine can change the folder '" +
                                             path("theirs") + "': its mode is 0777")));
  EXPECT_THAT([&] { parse_load_policy({}, path("theirs")); },
              ThrowsMessage<Error>(HasSubstr("every user of this machine")));
  EXPECT_THAT([&] { parse_load_policy({}, path("nowhere")); },
              ThrowsMessage<Error>(HasSubstr("there is no folder")));
  EXPECT_EQ(parse_load_policy({}, path("ours/link/../ours")).recordings, path("ours"));
}

// A folder that only its owner can change may have one that everybody can.
TEST_F(LoadPolicyTest, LetsNothingInFromASubfolderThatEverybodyCanChange) {
  const LoadPolicy policy{.folders = {real_folder(path("ours"))}};
  fs::permissions(folder_ / "ours/below", fs::perms::all);
  EXPECT_THAT(outcome(policy, path("ours/below/lib.so")),
              HasSubstr("every user of this machine can change the folder '" + path("ours/below")));
  fs::permissions(folder_ / "ours/below", fs::perms::owner_all);
  EXPECT_EQ(outcome(policy, path("ours/below/lib.so")), "ours/below/lib.so");
  fs::permissions(folder_ / "ours/below/lib.so", fs::perms::all);
  EXPECT_THAT(outcome(policy, path("ours/below/lib.so")),
              HasSubstr("every user of this machine can change the file"));
}

// Any user of the machine could make a container of root's run with root's rights what they wanted.
TEST_F(LoadPolicyTest, LetsNothingIntoAPrivilegedContainerUnlessItsOwnerSaysSo) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give up rights";
  SystemDescription system;
  SystemDescription secured;
  secured.dds.emplace().security.emplace();
  SystemDescription said;
  said.loads[said.name] = parse_load_policy({"index"});
  const auto error_of = [](const SystemDescription& process) -> std::string {
    try {
      load_policy(process).check();
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  };
  EXPECT_EQ(error_of(system),
            "this container runs as root, and its owner does not say that it may load components "
            "on request; write `load: index` for it in its file, or use `takt run --name NAME "
            "--load index`");
  EXPECT_EQ(error_of(secured), "");
  EXPECT_EQ(error_of(said), "");
  std::thread([&] {  // a system call, unlike the function of the C library, changes one thread
    constexpr std::uint32_t kRealTime = 1u << CAP_SYS_NICE | 1u << CAP_IPC_LOCK;
    const auto keep = [](std::uint32_t capabilities) {
      __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
      const __user_cap_data_struct data[_LINUX_CAPABILITY_U32S_3] = {
          {capabilities, capabilities, 0}, {0, 0, 0}};
      return syscall(SYS_capset, &header, data) == 0;
    };
    prctl(PR_SET_KEEPCAPS, 1);
    ASSERT_EQ(syscall(SYS_setresuid, 65534, 65534, 65534), 0);
    ASSERT_TRUE(keep(kRealTime | 1u << CAP_NET_RAW));
    EXPECT_THAT(error_of(system), StartsWith("this container has capabilities other than"));
    ASSERT_TRUE(keep(kRealTime));
    EXPECT_EQ(error_of(system), "");
  })
      .join();
}

TEST_F(LoadPolicyTest, IsOneWordOrFoldersInAnOption) {
  const auto error_of = [](const std::vector<std::string>& words) -> std::string {
    try {
      parse_load_policy(words);
      return "no error";
    } catch (const Error& error) {
      return error.what();
    }
  };
  EXPECT_EQ(parse_load_policy({}).kind, LoadPolicy::Kind::index);
  EXPECT_EQ(parse_load_policy({"off"}).kind, LoadPolicy::Kind::off);
  EXPECT_EQ(parse_load_policy({"any"}).kind, LoadPolicy::Kind::any);
  EXPECT_THAT(parse_load_policy({path("ours/link"), path("ours")}).folders,
              ElementsAre(path("theirs"), path("ours")));
  EXPECT_EQ(error_of({path("no")}),
            "there is no folder '" + path("no") + "'; name one that has libraries");
  EXPECT_THAT(error_of({"any", path("ours")}),
              StartsWith("'any' cannot be combined with other values"));
}

TEST(LoadPolicy, OfAFileIsThatOfTheContainer) {
  provide_workload();
  const ConfigurationFile file("robot.yaml",
                               "containers:\n"
                               "  - name: open\n"
                               "    load: any\n"
                               "    components: [{component: takt::Workload, name: a}]\n"
                               "  - name: closed\n"
                               "    load: off\n"
                               "    components: [{component: takt::Workload, name: b}]\n"
                               "  - name: own\n"
                               "    load: {libraries: [., ./], recordings: .}\n"
                               "    components: [{component: takt::Workload, name: c}]\n"
                               "  - name: plain\n"
                               "    components: [{component: takt::Workload, name: d}]\n");
  const SystemDescription system = file.read();
  const fs::path folder = fs::canonical(fs::path(file.path()).parent_path());
  std::vector<LoadPolicy> policies;
  for (const SystemDescription& process : split(system, Composition::file)) {
    policies.push_back(load_policy(process));
  }
  ASSERT_EQ(policies.size(), 4u);
  EXPECT_EQ(policies[0].kind, LoadPolicy::Kind::any);
  EXPECT_EQ(policies[1].kind, LoadPolicy::Kind::off);
  EXPECT_EQ(policies[2].kind, LoadPolicy::Kind::index);
  EXPECT_THAT(policies[2].folders, ElementsAre(folder.string(), folder.string()));
  EXPECT_EQ(policies[2].recordings, folder.string());
  EXPECT_EQ(policies[3].kind, LoadPolicy::Kind::index);
  EXPECT_THAT(policies[3].folders, testing::IsEmpty());
  EXPECT_EQ(load_policy(split(system, Composition::per_node)[1]).kind, LoadPolicy::Kind::off);
  EXPECT_EQ(load_policy(split(system, Composition::single)[0]).kind, LoadPolicy::Kind::any);
}

}  // namespace
}  // namespace takt
