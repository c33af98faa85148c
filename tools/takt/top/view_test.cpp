// What `takt top` shows, line by line, of containers that are made up.
// SPDX-License-Identifier: Apache-2.0
#include "top/view.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt::tools::top {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

StatisticsInterval::Callback callback(const std::string& name, double rate,
                                      Nanoseconds p99 = 10us) {
  StatisticsInterval::Callback row;
  row.executor = "fast";
  row.node = "/node";
  row.callback = name;
  row.rate = rate;
  row.latency.p50 = row.latency.p99 = row.latency.max = p99;
  return row;
}

std::vector<Watched> robot(std::vector<StatisticsInterval::Callback> callbacks) {
  Watched container{.name = "robot", .state = Watched::State::running, .pid = 7, .is_new = true};
  container.last.seconds = 1;
  container.last.callbacks = std::move(callbacks);
  return {container};
}

std::vector<Watched> three() {
  return robot({callback("b", 2, 30us), callback("a", 10, 20us), callback("c", 5)});
}

/// The names of the shown rows, "*" before the selected one.
std::vector<std::string> names(View& view, std::size_t height = 24) {
  std::vector<std::string> names;
  const std::vector<Line> lines = view.lines(160, height);
  for (std::size_t i = 4; i + 2 < lines.size(); ++i) {
    if (lines[i].text.size() < 2) continue;
    const std::string name = lines[i].text.substr(1, lines[i].text.find(' ', 1) - 1);
    names.push_back((lines[i].kind == Line::Kind::selected ? "*" : "") + name);
  }
  return names;
}

void press(View& view, const std::string& keys) {
  for (const char key : keys) EXPECT_TRUE(view.press(key));
}

std::string all_text(View& view, std::size_t width = 160) {
  std::string text;
  for (const Line& line : view.lines(width, 24)) text += line.text + "\n";
  return text;
}

TEST(View, SortsByTheChosenColumn) {
  View view(true);
  view.show(three());
  EXPECT_THAT(names(view), ElementsAre("*/node/a", "/node/b", "/node/c"));
  press(view, "r");
  EXPECT_THAT(names(view), ElementsAre("*/node/c", "/node/b", "/node/a"));
  press(view, "r");
  // Past the executor and the priority; the container has no column, as there is one only.
  for (int i = 0; i < 3; ++i) view.press(kRight);
  EXPECT_THAT(view.lines(160, 24)[3].text, HasSubstr("vcalls/s"));
  EXPECT_THAT(names(view), ElementsAre("*/node/a", "/node/c", "/node/b"));
  for (int i = 0; i < 3; ++i) view.press(kLeft);
  EXPECT_THAT(view.lines(160, 24)[3].text, StartsWith(" vcallback"));
}

TEST(View, SortsNamesAsPeopleCount) {
  View view(true);
  view.show(robot({callback("t_10", 1), callback("t_2", 1), callback("t_02", 1), callback("t", 1),
                   callback("t_2b", 1), callback("s_300", 1)}));
  EXPECT_THAT(names(view), ElementsAre("*/node/s_300", "/node/t", "/node/t_2", "/node/t_02",
                                       "/node/t_2b", "/node/t_10"));
}

TEST(View, TheChosenColumnIsOnTheScreenAndNamesKeepWhatDiffers) {
  View view(true);
  view.show(robot({callback("a_long_name_of_a_callback_of_the_front_lidar_1", 2),
                   callback("a_long_name_of_a_callback_of_the_front_lidar_2", 1)}));
  for (int i = 0; i < 12; ++i) {
    const std::vector<Line> lines = view.lines(80, 24);
    EXPECT_THAT(lines[3].text, testing::ContainsRegex("v[a-z]")) << i;
    EXPECT_THAT(lines[4].text + lines[5].text,
                testing::AllOf(HasSubstr("lidar_1"), HasSubstr("lidar_2")));
    view.press(kRight);
  }
}

TEST(View, HasAPageOfHelp) {
  View view(true);
  view.show(three());
  press(view, "?");
  EXPECT_THAT(all_text(view, 80),
              testing::AllOf(HasSubstr("sort the other way round"), Not(HasSubstr("/node/a"))));
  for (const Line& line : view.lines(80, 24)) EXPECT_LE(line.text.size(), 80u);
  EXPECT_EQ(view.lines(80, 5).size(), 5u);
  press(view, "?");
  EXPECT_THAT(all_text(view, 80), HasSubstr("/node/a"));
}

TEST(View, TheSelectedRowStaysSelected) {
  View view(true);
  view.show(three());
  view.press(kDown);
  EXPECT_THAT(names(view), ElementsAre("/node/a", "*/node/b", "/node/c"));
  press(view, "r");
  EXPECT_THAT(names(view), ElementsAre("/node/c", "*/node/b", "/node/a"));
  view.press(kEnd);
  view.press(kDown);
  EXPECT_THAT(names(view), ElementsAre("/node/c", "/node/b", "*/node/a"));
  view.show(robot({callback("b", 1)}));
  EXPECT_THAT(names(view), ElementsAre("*/node/b"));
}

TEST(View, ALowScreenFollowsTheSelectedRow) {
  View view(true);
  view.show(three());
  EXPECT_THAT(names(view, 8), ElementsAre("*/node/a", "/node/b"));
  view.press(kEnd);
  EXPECT_THAT(names(view, 8), ElementsAre("/node/b", "*/node/c"));
  for (std::size_t height = 0; height < 12; ++height) {
    for (std::size_t width = 0; width < 200; width += 7) {
      const std::vector<Line> lines = view.lines(width, height);
      EXPECT_EQ(lines.size(), height);
      for (const Line& line : lines) EXPECT_LE(line.text.size(), 3 * width);
    }
  }
}

TEST(View, AFilterShowsWhatHasIt) {
  View view(true);
  view.show(three());
  press(view, "/node/bq");  // no key of the table ends it
  view.press(kErase);
  EXPECT_THAT(all_text(view), HasSubstr("filter: node/b"));
  view.press('\n');
  EXPECT_THAT(names(view), ElementsAre("*/node/b"));
  EXPECT_THAT(all_text(view), HasSubstr("filter: node/b (Esc: all)"));
  view.press(kEscape);
  EXPECT_EQ(names(view).size(), 3u);
}

TEST(View, PauseKeepsWhatIsShown) {
  View view(true);
  view.show(three());
  press(view, "p");
  view.show(robot({callback("d", 1)}));
  EXPECT_EQ(names(view).size(), 3u);
  EXPECT_THAT(all_text(view), HasSubstr("PAUSED"));
  press(view, "p");
  EXPECT_THAT(names(view), ElementsAre("*/node/d"));
}

TEST(View, TheHistoryOfARowIsALineThatRisesAndFalls) {
  EXPECT_EQ(sparkline({0, 7, 3.5, 7}, 10, true), "▁█▅█");
  EXPECT_EQ(sparkline({0, 7, 0, 7}, 2, false), "_#");
  EXPECT_EQ(sparkline({5, 5}, 9, true), "▁▁");
  EXPECT_EQ(sparkline({}, 9, true), "");
  View view(true);
  for (const double rate : {0.0, 100.0, 50.0}) view.show(robot({callback("a", rate)}));
  EXPECT_THAT(all_text(view), HasSubstr("choose a column of numbers"));
  for (int i = 0; i < 3; ++i) view.press(kRight);
  EXPECT_THAT(all_text(view), HasSubstr("calls/s of /node/a: ▁█▅\n"));
}

TEST(View, RowsSayThatTheirContainerHasEndedAndWhatIsBad) {
  View view(true);
  std::vector<Watched> containers = three();
  containers[0].last.callbacks[0].faults.deadline_misses = 1;
  view.show(containers);
  EXPECT_THAT(all_text(view), HasSubstr("\n!/node/b "));
  containers[0].state = Watched::State::ended;
  view.show(containers);
  EXPECT_THAT(all_text(view), HasSubstr("robot (ended)"));
  EXPECT_THAT(all_text(view), HasSubstr("/node/c (ended)"));
}

TEST(View, OldRowsComeLastAndAddNothingToTheHistory) {
  View view(true);
  std::vector<Watched> containers = {robot({callback("fast", 100)})[0],
                                     robot({callback("slow", 1)})[0]};
  containers[1].name = "second";
  view.show(containers);
  for (int i = 0; i < 4; ++i) view.press(kRight);
  view.press(kHome);
  EXPECT_THAT(names(view), ElementsAre("*/node/fast", "/node/slow"));
  for (const auto state : {Watched::State::ended, Watched::State::gone, Watched::State::silent,
                           Watched::State::ambiguous}) {
    containers[0].state = state;
    containers[0].is_new = false;
    view.show(containers);
    EXPECT_THAT(names(view), ElementsAre("/node/slow", "*/node/fast"));
    EXPECT_THAT(all_text(view), testing::ContainsRegex("/node/fast .(ended|gone|old)."));
    EXPECT_THAT(all_text(view), HasSubstr("calls/s of /node/fast: ▁\n"));
  }
}

TEST(View, WhereNotAllStatesFitThoseThatDoNotRunAreFirst) {
  View view(true);
  std::vector<Watched> containers;
  for (int i = 0; i < 9; ++i) {
    containers.push_back(three()[0]);
    containers.back().name = "c" + std::to_string(i);
  }
  containers[8].state = Watched::State::ended;
  view.show(containers);
  EXPECT_EQ(view.lines(60, 24)[1].text, "c8 (ended)   c0 (pid 7, CPU 0.0 %)   and 7 more");
  EXPECT_THAT(view.lines(400, 24)[1].text, Not(HasSubstr("more")));
  EXPECT_THAT(view.lines(60, 6)[1].text, StartsWith("c8 (ended)"));
  EXPECT_THAT(view.lines(60, 6).back().text, StartsWith("? help"));
}

TEST(View, TheFirstAnswerOfAContainerHasNoRates) {
  View view(true);
  std::vector<Watched> containers = three();
  containers[0].last.seconds = 0;
  containers[0].last.callbacks[0].faults.deadline_misses = 1;
  view.show(containers);
  EXPECT_THAT(all_text(view), HasSubstr("robot (pid 7, CPU -)"));
  EXPECT_THAT(all_text(view), testing::ContainsRegex("\n /node/b +fast +0 +- +- "));
}

TEST(View, EachKeyShowsItsTable) {
  View view(true);
  std::vector<Watched> containers = three();
  StatisticsInterval& last = containers[0].last;
  last.threads.push_back({});
  last.threads[0].name = "spinner";
  last.threads[0].affinity = {0, 1, 2, 5};
  last.executors.push_back({});
  last.executors[0].name = "fast";
  last.chains.push_back({.name = "sense_to_act", .deadline = 20ms});
  last.topics.push_back({});
  last.topics[0].name = "/scan";
  last.deviations.push_back({});
  last.deviations[0].text = "unexpected";
  view.show(containers);
  const std::vector<std::string> shown{"spinner",      "fast",  "/node/a",
                                       "sense_to_act", "/scan", "unexpected"};
  for (std::size_t i = 0; i < shown.size(); ++i) {
    press(view, std::to_string(i + 1));
    EXPECT_THAT(names(view).at(0), testing::EndsWith(shown[i]));
  }
  press(view, "\t");
  EXPECT_THAT(all_text(view), HasSubstr("0-2,5"));
  EXPECT_FALSE(view.press('q'));
}

// A name from the wire steers no terminal, and makes no line of its own.
TEST(View, NamesAreData) {
  View view(true);
  view.show(robot({callback("evil\x1b[2J\nline", 1)}));
  const std::string text = all_text(view);
  EXPECT_THAT(text, HasSubstr("evil\\u001b[2J\\nline"));
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
}

}  // namespace
}  // namespace takt::tools::top
