// Tests of reading files that nobody has looked at before.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/document.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "takt/containers/configuration/configuration_file_test.hpp"

namespace takt {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string yaml_errors(const std::string& text) {
  return ConfigurationFile("robot.yaml", text).errors();
}
std::string json_errors(const std::string& text) {
  provide_workload();
  return ConfigurationFile("robot.json", text).errors();
}
std::string error_at(const std::string& path) {
  try {
    read_system(path);
    return "no error";
  } catch (const ConfigurationError& error) {
    return error.what();
  }
}
std::string repeated(const std::string& text, int times) {
  std::string result;
  for (int i = 0; i < times; ++i) result += text;
  return result;
}

constexpr const char* kWorkload =
    "container:\n  components:\n    - component: takt::Workload\n      name: a\n";
constexpr const char* kYamlAdvice =
    "; write valid YAML here: check indentation, brackets, quotes and anchors\n";

TEST(Document, ThatIsNotThereIsAnError) {
  EXPECT_EQ(error_at("no_such.yaml"),
            "no_such.yaml:1: the file cannot be read: No such file or directory; check its name "
            "and its permissions");
  EXPECT_EQ(error_at("no_such.json"),
            "no_such.json:1: the file cannot be read: No such file or directory; check its name "
            "and its permissions");
  EXPECT_EQ(error_at("/tmp"), "/tmp:1: this is a directory; name a file in it");
}

TEST(Document, ThatIsEmptyIsAnError) {
  for (const char* text : {"", " \n\n", "# only a comment\n", "~\n", "---\n"}) {
    EXPECT_EQ(yaml_errors(text), "robot.yaml:1: the file is empty; write a system description\n");
  }
  for (const char* text : {"", " \n\t\n", "null"}) {
    EXPECT_EQ(json_errors(text), "robot.json:1: the file is empty; write a system description\n");
  }
}

TEST(Document, ThatIsTooLargeIsRefusedBeforeItIsParsed) {
  EXPECT_EQ(yaml_errors("a: &x [*x]\n" + std::string(5 << 20, '#')),
            "robot.yaml:1: the file is larger than 4 MiB; name another file\n");
}

// To open a FIFO would wait until somebody writes to it.
TEST(Document, ThatIsNoRegularFileIsRefused) {
  const std::string fifo = testing::TempDir() + fmt::format("takt_fifo_{}", getpid());
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_EQ(error_at(fifo), fifo + ":1: this is a FIFO or a pipe; name a regular file");
  std::filesystem::remove(fifo);
  EXPECT_EQ(error_at("/dev/zero"), "/dev/zero:1: this is a device; name a regular file");
}

TEST(Document, ThatIsNoTextIsAnErrorInItsLine) {
  using namespace std::string_literals;
  const std::vector<std::pair<std::string, std::string>> bytes{
      {"\0"s, "0x00"},          // what programs are full of
      {"\x04", "0x04"},         // the end of the file to yaml-cpp
      {"\xff", "0xff"},         // never in UTF-8
      {"\xc3(", "0xc3"},        // a character that is not finished
      {"\xc0\xaf", "0xc0"},     // '/' in more bytes than it needs
      {"\xed\xa0\x80", "0xed"}  // half a character of UTF-16
  };
  for (const auto& [text, name] : bytes) {
    const std::string message =
        ":3: the byte " + name + " is not allowed in a text file; give a file that is UTF-8 text\n";
    EXPECT_EQ(yaml_errors("a: 1\n\nb: " + text), "robot.yaml" + message);
    EXPECT_EQ(json_errors("{\n\n\"" + text), "robot.json" + message);
  }
}

TEST(Document, MayBeginWithAByteOrderMarkAndEndLinesAsWindowsDoes) {
  EXPECT_THAT(yaml_errors("\xef\xbb\xbf# ü\r\nrealtim: 1\r\n"),
              StartsWith("robot.yaml:2: 'realtim' is not a key"));
}

// ---- YAML ----

TEST(YamlDocument, WithBrokenSyntaxIsOneError) {
  EXPECT_EQ(yaml_errors("a: 1\nb: c: d\n"),
            "robot.yaml:2: a ':' is not allowed here; put the text in quotes, indent it as the "
            "line above, or add ': ' to that line\n");
  EXPECT_EQ(yaml_errors("a: 1\nb: @c\n"),
            "robot.yaml:2: no text begins with this character; put it in quotes\n");
  EXPECT_EQ(yaml_errors("a: *nothing\n"),
            std::string("robot.yaml:1: the referenced anchor is not defined") + kYamlAdvice);
}

TEST(YamlDocument, ThatIsCutOffIsAnErrorInItsLastLine) {
  EXPECT_EQ(yaml_errors("a:\n  b: {c: 1,\n"),
            "robot.yaml:2: a ',' or a '}' is missing; close every '{' with '}', and separate "
            "items with ','\n");
  EXPECT_EQ(yaml_errors("a:\n  b: [c,\n\n"),
            "robot.yaml:2: a ',' or a ']' is missing; close every '[' with ']', and separate "
            "items with ','\n");
  for (const char* quotes : {"\"", "'"}) {
    EXPECT_EQ(yaml_errors(std::string("a: 1\nb: ") + quotes + "cut\n"),
              "robot.yaml:2: a text in quotes does not end; close the quotes\n");
  }
}

TEST(YamlDocument, IndentedWithTabsIsAnError) {
  EXPECT_EQ(yaml_errors("threads:\n\ta: {}\n"),
            "robot.yaml:2: the indentation contains a tab; indent with spaces\n");
  EXPECT_EQ(yaml_errors("threads:\n  a: {}\n\tb: {}\n"),
            "robot.yaml:3: the indentation contains a tab; indent with spaces\n");
}

TEST(YamlDocument, IsOnlyOne) {
  const std::string message =
      " this line does not continue the lines above; correct the indentation, or remove '---': a "
      "file is one document\n";
  EXPECT_EQ(yaml_errors("a: 1\n---\nb: 1\n"), "robot.yaml:2:" + message);
  EXPECT_EQ(yaml_errors("- a\nb: 1\n"), "robot.yaml:2:" + message);
}

TEST(YamlDocument, HasWordsAsKeys) {
  const std::string advice = "; write a word before the ':'\n";
  EXPECT_EQ(yaml_errors("a: 1\n? [b]\n: c\n"),
            "robot.yaml:2: a list or a map is used as a key" + advice);
  EXPECT_EQ(yaml_errors("a: &b c\n*b : d\n"), "robot.yaml:2: an alias is used as a key" + advice);
  EXPECT_EQ(yaml_errors("a: 1\n: c\n"), "robot.yaml:2: a key is empty" + advice);
}

TEST(YamlDocument, KnowsTheLineOfWhatIsLeftEmpty) {
  EXPECT_EQ(yaml_errors("container:\n  components:\n    -\n\n\n    - ~\n    -\n"),
            "robot.yaml:3: 'components[0]' is empty; write a map\n"
            "robot.yaml:6: 'components[1]' is empty; write a map\n"
            "robot.yaml:7: 'components[2]' is empty; write a map\n");
}

TEST(YamlDocument, HasNoTags) {
  EXPECT_EQ(yaml_errors("a: 1\nb: !robot {}\n"),
            "robot.yaml:2: a tag ('!…') is not supported; remove it\n");
}

// The other way round, a parameter file of ROS 2 is read as ROS 2 does: see
// parameter_file_test.cpp.
TEST(YamlDocument, HasNoTextThatRos2ReadsInAnotherWay) {
  const auto errors = [](const std::string& value) {
    return ConfigurationFile("robot.yaml",
                             std::string(kWorkload) + "      parameters: {a: " + value + "}\n")
        .errors();
  };
  const std::string place = "robot.yaml:5: ";
  EXPECT_EQ(errors("yes"), place +
                               "yes is \"yes\" in YAML 1.2, and true in parameter files of ROS 2; "
                               "write \"yes\" or true\n");
  EXPECT_THAT(errors("010"), HasSubstr("010 is 10 in YAML 1.2, and 8 in parameter files of ROS 2; "
                                       "write 10 or 8"));
  EXPECT_THAT(errors("[a, off]"), HasSubstr("off is \"off\" in YAML 1.2, and false in"));
  for (const char* const text : {"n", "08", "0o10", "-0x1F", "0x1p3", "~"}) {
    EXPECT_NE(errors(text), "") << text;
  }
  for (const char* const text : {"\"yes\"", "'010'", "!!str on", "0x1F", "1e3", "5.", "nan",
                                 "12:30", ".nan", "+.inf", "1_000", "yes1", "tRue"}) {
    EXPECT_THAT(errors(text), Not(HasSubstr("in YAML 1.2"))) << text;
  }
  EXPECT_THAT(yaml_errors("a: &b {c: 1}\nd: {<<: *b}\n"),
              HasSubstr("robot.yaml:2: a merge key is not supported"));
}

TEST(Document, OfAnotherKindIsCalledByItsName) {
  EXPECT_THAT(
      yaml_errors("/**:\n  front:\n    ros__parameters: {a: yes}\n"),
      HasSubstr("this is a parameter file of ROS 2, which describes no system; give it to a "
                "program, --ros-args --params-file"));
  EXPECT_THAT(yaml_errors("launch:\n- node: {pkg: a, exec: b}\n"),
              HasSubstr("this is a launch file of ROS 2"));
  EXPECT_THAT(
      ConfigurationFile("robot.launch.py", "import launch\n").errors(),
      HasSubstr("robot.launch.py:1: this is a launch file of ROS 2, which starts processes; "
                "start it with ros2 launch"));
}

TEST(YamlDocument, DoesNotContainItself) {
  EXPECT_EQ(yaml_errors("container: &all\n  components:\n    - *all\n"),
            "robot.yaml:3: this alias refers to a value that contains it; write the value "
            "instead\n");
}

// Ten aliases for ten aliases for ten aliases: a few lines become more than memory can hold.
TEST(YamlDocument, DoesNotExplode) {
  std::string text = "a: &a [x, x, x, x, x, x, x, x, x, x]\n";
  for (char name = 'b'; name <= 'k'; ++name) {
    const std::string alias = std::string("*") + static_cast<char>(name - 1);
    text += std::string(1, name) + ": &" + name + " [" + alias + repeated(", " + alias, 9) + "]\n";
  }
  EXPECT_EQ(yaml_errors(text),
            "robot.yaml:5: the file has more than 100000 values; describe a smaller system, with "
            "fewer aliases\n");
}

TEST(YamlDocument, IsNotDeep) {
  EXPECT_EQ(yaml_errors("a:\n  " + repeated("[", 100) + repeated("]", 100)),
            "robot.yaml:2: this is nested deeper than 64 levels; use fewer levels\n");
  EXPECT_EQ(yaml_errors(repeated("- ", 100'000) + "x"),
            "robot.yaml:1: this is nested deeper than 64 levels; use fewer levels\n");
  EXPECT_EQ(yaml_errors("a: " + repeated("[", 100'000)),
            "robot.yaml:1: this is nested too deeply; use fewer levels\n");
}

// Every line of /etc/shadow, a private key and a list of passwords were shown as keys and values
// that are wrong, for everybody with takt's log to read.
TEST(Document, ThatIsNotOursIsNotShown) {
  for (const char* const text :
       {"root:secret:19000:0:99999:7:::\nbin:secret:19000:0:99999:7:::\n",
        "-----BEGIN PRIVATE KEY-----\nsecret\n-----END PRIVATE KEY-----\n", "TOKEN=secret\n",
        "password: secret\nsecret: x\n", "- secret\n", "!secret x\n", "a: *secret\n",
        "secret: 1\nsecret: 2\n", "a: 9999999999999999999secret\n", "{secret: [}\n", "'secret\n",
        "secret: 99999999999999999999\n"}) {
    const std::string errors = yaml_errors(text);
    EXPECT_THAT(errors, AllOf(HasSubstr("robot.yaml:"), Not(HasSubstr("secret")))) << text;
  }
  for (const char* const text : {"{\"password\": \"secret\"}", "[\"secret\", secret]", "secret",
                                 "{\"secret\" 1}", "{\"a\": \"secret"}) {
    EXPECT_THAT(json_errors(text), Not(HasSubstr("secret"))) << text;
  }
}

TEST(YamlDocument, DoesNotWriteOnTheTerminalOfItsReader) {
  EXPECT_EQ(
      yaml_errors("\"a\\e[31m\\nb\": 1\ncontainer: {}\n"),
      "robot.yaml:1: 'a\\u001b[31m\\nb' is not a key of the file; valid: realtime, memory, "
      "cpu_dma_latency_us, threads, dds, topics, schedulers, wait_backends, executors, nodes, "
      "container, containers, lifecycle, machine, model, analysis, accept, priorities, chains, "
      "modes\n"
      "robot.yaml:2: a container needs the key 'components'; add it\n");
  EXPECT_EQ(yaml_errors("\"a\\0b\": 1\n"),
            "robot.yaml:1: this text contains a zero byte; remove it\n");
  EXPECT_LT(yaml_errors("realtime: " + std::string(1 << 20, 'x')).size(), 3000U);
}

// ---- JSON ----

TEST(JsonDocument, WithBrokenSyntaxIsOneError) {
  EXPECT_EQ(json_errors("{\n  \"nodes\": [\n    {\"node_name\": \"a\",}\n  ]\n}\n"),
            "robot.json:3: syntax error while parsing object key - unexpected '}', expected string "
            "literal; write valid JSON here\n");
  EXPECT_EQ(json_errors("{}\n\nx"),
            "robot.json:3: syntax error while parsing value - invalid literal, expected "
            "end of input; write valid JSON here\n");
  EXPECT_EQ(json_errors("{\"a\":\n 1e999}"),
            "robot.json:2: number overflow parsing '1e999'; write valid JSON here\n");
}

TEST(JsonDocument, ThatIsCutOffIsAnErrorInItsLastLine) {
  EXPECT_EQ(json_errors("{\n  \"nodes\": [\n    {\"node_name\": \"a\"},\n\n"),
            "robot.json:3: syntax error while parsing value - unexpected end of input, expected "
            "'[', '{', or a literal; write valid JSON here\n");
  EXPECT_THAT(json_errors("{\n  \"nodes\": [\n    {\"node_na"),
              StartsWith("robot.json:3: syntax error while parsing object key - invalid string: "
                         "missing closing quote"));
}

TEST(JsonDocument, KnowsTheLineOfEachValue) {
  EXPECT_EQ(json_errors("{\"nodes\": [1,\n2\n,\n\"x\", true,\n{\n}\n,[],\n\n1.5]}"),
            "robot.json:1: 'nodes[0]' is 1; write a map\n"
            "robot.json:2: 'nodes[1]' is 2; write a map\n"
            "robot.json:4: 'nodes[2]' is 'x'; write a map\n"
            "robot.json:4: 'nodes[3]' is true; write a map\n"
            "robot.json:5: a node needs the key 'node_name'; add it\n"
            "robot.json:7: 'nodes[5]' is a list; write a map\n"
            "robot.json:9: 'nodes[6]' is 1.5; write a map\n");
}

TEST(JsonDocument, RefusesKeysThatStandTwice) {
  EXPECT_EQ(json_errors("{\"nodes\":\n [{\"node_name\": \"a\"}],\n \"nodes\": []}"),
            "robot.json:3: 'nodes' is already in line 1; remove one of them\n");
}

TEST(JsonDocument, IsNotDeep) {
  EXPECT_EQ(json_errors("{\"nodes\":\n" + repeated("[", 1'000'000)),
            "robot.json:2: this is nested deeper than 64 levels; use fewer levels\n");
}

}  // namespace
}  // namespace takt
