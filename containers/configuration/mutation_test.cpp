// A fuzz test of the readers: right and wrong files, changed at random, are read or refused. What
// it tries is the same in every run; how much of it, a budget says.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/configuration/document.hpp"
#include "takt/containers/set_callback_parameters.hpp"

namespace takt {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using namespace std::string_view_literals;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::size_t kRounds = 3'000;
constexpr auto kLongestOfOne = 20s;
#else
constexpr std::size_t kRounds = 20'000;
constexpr auto kLongestOfOne = 2s;
#endif
constexpr auto kBudget = 10s;
constexpr std::size_t kMaxBytes = 1 << 17;  // more only takes longer

std::size_t from_environment(const char* name, std::size_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

// The time of this thread, as the machine may be busy with other tests.
std::chrono::nanoseconds cpu_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

struct Sample {
  std::string text;
  bool is_json;
  std::vector<std::string> lines;
};

// What means something to a parser, and what means something to a reader.
constexpr std::string_view kTokens[] = {": ",
                                        ":",
                                        "- ",
                                        "-",
                                        ", ",
                                        "{",
                                        "}",
                                        "[",
                                        "]",
                                        "{}",
                                        "[]",
                                        "\"",
                                        "'",
                                        "\\",
                                        "#",
                                        " ",
                                        "    ",
                                        "\t",
                                        "\n",
                                        "\r\n",
                                        "\n\n",
                                        "&a ",
                                        "*a",
                                        "&common ",
                                        "*common",
                                        "<<: *common\n",
                                        "!",
                                        "!!str ",
                                        "! ",
                                        "? ",
                                        "| ",
                                        "|+2\n",
                                        ">-\n",
                                        "@",
                                        "`",
                                        "%",
                                        "%YAML 1.1\n",
                                        "%TAG ! tag:\n",
                                        "---\n",
                                        "...\n",
                                        "~",
                                        "null",
                                        "true",
                                        "yes",
                                        ".nan",
                                        "-.inf",
                                        "\0"sv,
                                        "\x7f",
                                        "\x80",
                                        "\xff",
                                        "\xef\xbb\xbf",
                                        "\xc2\x85",
                                        "\xe2\x80\xa8",
                                        "\\u0000",
                                        "\\x00",
                                        "\\ud800",
                                        "\\e[31m",
                                        "//",
                                        "/",
                                        "~/",
                                        "a//b",
                                        "..",
                                        "{one: lidar/timer}",
                                        "default",
                                        "auto",
                                        "0ns",
                                        "1h"};
constexpr std::string_view kNumbers[] = {"0",
                                         "-0",
                                         "-1",
                                         "1",
                                         "010",
                                         "0x",
                                         "0x7fffffffffffffff",
                                         "0o17",
                                         "2147483647",
                                         "2147483648",
                                         "-2147483648",
                                         "-2147483649",
                                         "9223372036854775807",
                                         "9223372036854775808",
                                         "-9223372036854775808",
                                         "18446744073709551616",
                                         "1e308",
                                         "1e309",
                                         "-1e309",
                                         "1e-400",
                                         "5e-324",
                                         "0.1",
                                         "1.",
                                         ".5",
                                         "1e",
                                         "99999",
                                         "100000",
                                         "100001",
                                         "1_000",
                                         "99999999999999999999999999999999999999999999999999"};

/// Thread safety: none.
/// Real-time: no.
class Mutator {
 public:
  explicit Mutator(std::vector<Sample> samples) : samples_(std::move(samples)) {}

  /// The sample that this number stands for, in any run and on any machine.
  Sample mutated(std::uint64_t number) {
    random_.seed(number);
    Sample result = samples_[pick(samples_.size())];
    const std::size_t changes = 1 + pick(pick(3) == 0 ? 6 : 2);
    for (std::size_t i = 0; i < changes; ++i) change(result.text);
    if (pick(50) == 0) result.is_json = !result.is_json;  // the name of the file says it
    if (result.text.size() > kMaxBytes) result.text.resize(kMaxBytes);
    return result;
  }

 private:
  // Not by a distribution, which is another one in each standard library.
  std::size_t pick(std::size_t count) { return count == 0 ? 0 : random_() % count; }

  const Sample& any_sample() { return samples_[pick(samples_.size())]; }

  // Where the line at this position begins, and where the next one does.
  static std::pair<std::size_t, std::size_t> line_at(const std::string& text, std::size_t at) {
    const std::size_t before = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
    const std::size_t end = text.find('\n', at);
    return {before == std::string::npos ? 0 : before + 1,
            end == std::string::npos ? text.size() : end + 1};
  }
  // A word or number of the text, from a random position on; the empty end when there is none.
  template <class Is>
  std::pair<std::size_t, std::size_t> run_of(const std::string& text, Is is) {
    const auto test = [&](char c) { return is(static_cast<unsigned char>(c)); };
    const auto start = text.begin() + static_cast<std::ptrdiff_t>(pick(text.size()));
    const auto begin = std::find_if(start, text.end(), test);
    const auto end = std::find_if_not(begin, text.end(), test);
    return {static_cast<std::size_t>(begin - text.begin()), static_cast<std::size_t>(end - begin)};
  }

  static bool is_word(int c) { return std::isalnum(c) != 0 || c == '_'; }

  // A token in the place of a word.
  void replace_word(std::string& text) {
    const auto [word, length] = run_of(text, is_word);
    text.replace(word, length, kTokens[pick(std::size(kTokens))]);
  }
  void replace_number(std::string& text) {
    const auto [number, length] = run_of(text, [](int c) { return std::isdigit(c) != 0; });
    text.replace(number, length, kNumbers[pick(std::size(kNumbers))]);
  }
  // A word of another file, or of this one, in the place of a word.
  void copy_word(std::string& text) {
    const std::string& other = any_sample().text;
    const auto [from, from_length] = run_of(other, is_word);
    const std::string word = other.substr(from, from_length);
    const auto [to, to_length] = run_of(text, is_word);
    text.replace(to, to_length, word);
  }
  // The same characters over and over.
  void repeat(std::string& text, std::size_t at) {
    const std::string part = text.substr(at, 1 + pick(30));
    std::string parts;
    for (std::size_t times = 1 + pick(pick(4) == 0 ? 2'000 : 20); times > 0; --times) {
      parts += part;
    }
    text.insert(at, parts);
  }

  void change(std::string& text) {
    const std::size_t at = pick(text.size());
    const auto [begin, end] = line_at(text, at);
    const std::string line = text.substr(begin, end - begin);
    switch (pick(14)) {
      case 0:  // a bit
        if (!text.empty()) text[at] = static_cast<char>(text[at] ^ (1 << pick(8)));
        break;
      case 1:  // some characters are lost
        text.erase(at, 1 + pick(pick(4) == 0 ? 200 : 4));
        break;
      case 2:
        text.insert(at, kTokens[pick(std::size(kTokens))]);
        break;
      case 3:
        replace_word(text);
        break;
      case 4:
        replace_number(text);
        break;
      case 5:  // a line again
        text.insert(begin, line);
        break;
      case 6:
        text.erase(begin, end - begin);
        break;
      case 7: {  // a line of another file, or of this one
        const auto& lines = any_sample().lines;
        if (!lines.empty()) text.insert(begin, lines[pick(lines.size())]);
        break;
      }
      case 8: {
        const auto& lines = any_sample().lines;
        if (!lines.empty()) text.replace(begin, end - begin, lines[pick(lines.size())]);
        break;
      }
      case 9:
        copy_word(text);
        break;
      case 10:  // another depth
        if (pick(2) == 0) {
          text.insert(begin, 1 + pick(4), ' ');
        } else {
          text.erase(begin, std::min(line.find_first_not_of(' '), 1 + pick(4)));
        }
        break;
      case 11:
        repeat(text, at);
        break;
      case 12:  // cut off
        text.resize(at);
        break;
      default: {  // the rest of another file
        const std::string& other = any_sample().text;
        text.resize(at);
        text += other.substr(pick(other.size()));
        break;
      }
    }
  }

  const std::vector<Sample> samples_;
  std::mt19937_64 random_;  // the same numbers everywhere, by the standard
};

std::vector<Sample> samples() {
  std::vector<fs::path> files;
  for (const char* folder : {TAKT_GOOD_FILES, TAKT_BAD_FILES}) {
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Sample> result;
  for (const fs::path& file : files) {
    if (file.extension() == ".txt") continue;
    std::ifstream stream(file, std::ios::binary);
    Sample sample{{std::istreambuf_iterator(stream), {}}, document::is_json(file.string()), {}};
    for (std::size_t at = 0; at < sample.text.size();) {
      const std::size_t end = std::min(sample.text.find('\n', at), sample.text.size() - 1) + 1;
      sample.lines.push_back(sample.text.substr(at, end - at));
      at = end;
    }
    // The right ones have most to lose: about every second one is.
    const int weight = file.parent_path() == TAKT_GOOD_FILES ? 60 : 1;
    for (int i = 0; i < weight; ++i) result.push_back(sample);
  }
  return result;
}

// "FILE:LINE: what"
bool has_place(std::string_view line, const std::string& file) {
  if (!line.starts_with(file + ":")) return false;
  line.remove_prefix(file.size() + 1);
  const std::size_t digits = line.find_first_not_of("0123456789");
  return digits != 0 && digits != std::string_view::npos && line.substr(digits).starts_with(": ") &&
         line[0] != '0' && line.size() > digits + 2;
}

template <class Read>
void expect_to_be_read_or_refused(const std::string& place, Read read) {
  try {
    read();
  } catch (const ConfigurationError& error) {
    EXPECT_FALSE(error.errors().empty());
    for (const std::string& line : error.errors()) {
      EXPECT_TRUE(has_place(line, place)) << line;
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    }
  } catch (const std::exception& error) {
    ADD_FAILURE() << "not a ConfigurationError: " << error.what();
  }
}

TEST(GoodFiles, AreRead) {
  provide_workload();
  for (const auto& entry : fs::directory_iterator(TAKT_GOOD_FILES)) {
    EXPECT_NO_THROW(read_system(entry.path())) << entry.path();
  }
}

// When this crashes, the file that did it is still there, in the youngest folder takt_* of the
// directory for temporary files. TAKT_MUTATION_ROUNDS and TAKT_MUTATION_SEED make it try more, and
// others; TAKT_MUTATION_SEED=n TAKT_MUTATION_ROUNDS=1 tries the n-th alone.
TEST(MutatedFiles, AreReadOrRefusedWithALine) {
  provide_workload();
  const std::size_t first = from_environment("TAKT_MUTATION_SEED", 0);
  const std::size_t rounds = from_environment("TAKT_MUTATION_ROUNDS", kRounds);
  const bool has_budget = std::getenv("TAKT_MUTATION_ROUNDS") == nullptr;
  Mutator mutator(samples());
  const ConfigurationFile yaml("mutated.yaml", "");
  const ConfigurationFile json("mutated.json", "");
  const auto end = std::chrono::steady_clock::now() + kBudget;
  std::size_t tried = 0;
  std::size_t right = 0;
  for (; tried < rounds && !HasFailure(); ++tried) {
    if (has_budget && std::chrono::steady_clock::now() > end) break;
    const Sample sample = mutator.mutated(first + tried);
    const std::string path = (sample.is_json ? json : yaml).path();
    std::ofstream(path, std::ios::binary) << sample.text;
    SCOPED_TRACE("TAKT_MUTATION_SEED=" + std::to_string(first + tried) + ":\n" + sample.text);
    const auto begin = cpu_time();
    expect_to_be_read_or_refused(path, [&] {
      const SystemDescription system = read_system(path);
      for (const auto composition :
           {Composition::file, Composition::single, Composition::per_node}) {
        EXPECT_FALSE(split(system, composition).empty());
      }
      ++right;
    });
    // The same parser reads what comes over the network.
    expect_to_be_read_or_refused("request", [&] { read_parameter_changes(sample.text); });
    EXPECT_LT(cpu_time() - begin, kLongestOfOne);
  }
  RecordProperty("tried", std::to_string(tried));
  RecordProperty("right", std::to_string(right));
  EXPECT_GT(right, tried / 50) << "hardly anything gets past the parser";
  EXPECT_LT(right, tried);
}

// Every name was compared with every other by making nodes of both: 40 seconds and more.
TEST(LargeFiles, AreReadSoon) {
  provide_workload();
  constexpr int kComponents = 5'000;
  std::string text = "container:\n  components:\n";
  std::string nodes;
  std::string steps;
  for (int i = 0; i < kComponents; ++i) {
    text += "    - {component: takt::Workload, name: a" + std::to_string(i) + "}\n";
    nodes += (i == 0 ? "a" : ", a") + std::to_string(i);
    steps += (i == 0 ? "a4999/x" : ", a4999/x") + std::to_string(i);
  }
  text += "lifecycle:\n  bring_up: [" + nodes + "]\n";
  text += "chains:\n  - {name: long, path: [" + steps + "]}\n";
  const auto begin = cpu_time();
  EXPECT_EQ(ConfigurationFile("large.yaml", text).errors(), "no error\n");
  EXPECT_LT(cpu_time() - begin, kLongestOfOne);
}

}  // namespace
}  // namespace takt
