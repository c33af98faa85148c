// SPDX-License-Identifier: Apache-2.0
#include "picture/dot.hpp"

#include <algorithm>
#include <array>
#include <ctime>
#include <iterator>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/base/temporary.hpp"
#include "takt/transport/qos.hpp"

#include "run/feed.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

// Distinct also for people that do not see red and green alike (Okabe and Ito, 2008); red is taken.
constexpr std::array kColours{"#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#8c6d31"};
constexpr const char* kRed = "#d00000";

// What graphviz draws, on a dark screen: the same, with colours that are legible there.
constexpr std::string_view kDark = R"(
<style>
@media (prefers-color-scheme: dark) {
  .graph [fill="white"] { fill: #181818 }
  .graph [fill="#f0f0f0"] { fill: #282828 }
  .graph text:not([fill]) { fill: #ddd }
  .graph [stroke="black"], .graph [stroke="#404040"], .graph [stroke="#c0c0c0"] { stroke: #888 }
  .graph [stroke="#606060"] { stroke: #aaa }
  .graph [fill="#606060"] { fill: #aaa }
  .graph [stroke="#d00000"] { stroke: #ff6b60 }
  .graph [fill="#d00000"] { fill: #ff6b60 }
  .graph [stroke="#0072b2"] { stroke: #3d9be0 }
  .graph [fill="#0072b2"] { fill: #3d9be0 }
  .graph [stroke="#8c6d31"] { stroke: #b8964f }
  .graph [fill="#8c6d31"] { fill: #b8964f }
}
</style>
)";

const std::string kMark = fmt::format("<!-- {} -->", kTaktsText);

std::string dot_string(std::string_view text) {
  std::string result = "\"";
  for (const char c : printable(text, Lines::keep)) {
    if (c == '"' || c == '\\') result += '\\';
    if (c == '\n') {
      result += "\\n";
    } else if (c == '&') {
      result += "&amp;";  // graphviz reads entities
    } else {
      result += c;
    }
  }
  return result + '"';
}

std::string html(std::string_view text) {
  std::string result;
  for (const char c : printable(text)) {
    switch (c) {
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '&':
        result += "&amp;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string text(const json& of, const char* key) {
  return of.at(key).get<std::string>();
}

std::string thread_text(const json& thread) {
  std::string result = fmt::format("{}: {}", text(thread, "name"), text(thread, "policy"));
  if (const int priority = thread.at("priority"); priority != 0) {
    result += fmt::format(" {}", priority);
  }
  const auto cpus = thread.at("cpus").get<std::vector<int>>();
  if (!cpus.empty()) result += fmt::format(", CPU {}", fmt::join(cpus, ","));
  return result;
}

std::string qos_text(const json& end) {
  std::string result = end.at("reliable").get<bool>() ? "" : "best effort, ";
  if (end.at("transient_local").get<bool>()) result += "transient local, ";
  const auto depth = end.at("depth").get<std::size_t>();
  return result + (depth == QoS().keep_all().depth ? "keep all" : fmt::format("depth {}", depth));
}

std::string rate_text(const json& end) {
  return end.contains("rate_hz") ? fmt::format("{:.4g} Hz", end.at("rate_hz").get<double>()) : "";
}

class Drawing {
 public:
  explicit Drawing(const json& graph) : graph_(graph) {
    for (std::size_t i = 0; i < graph.at("chains").size(); ++i) add_chain(i);
  }

  std::string text() {
    line("// {}", kTaktsText);
    line("digraph {}", dot_string(tools::text(graph_, "title")));
    line("{{\nrankdir=LR; compound=true; fontname=\"sans-serif\"; nodesep=0.3; ranksep=0.9;");
    line("node [shape=box, style=\"rounded,filled\", fillcolor=white, fontname=\"sans-serif\"];");
    line("edge [fontname=\"sans-serif\", fontsize=10, color=\"#606060\"];");
    for (const json& process : graph_.at("processes")) draw_process(process);
    for (const json& topic : graph_.at("topics")) draw_topic(topic);
    draw_legend();
    return out_ + "}\n";
  }

 private:
  using Place = std::pair<std::string, std::string>;  // process and node
  struct Link {
    Place from, to;
    std::string topic;
    auto operator<=>(const Link&) const = default;
  };

  template <class... Args>
  void line(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(out_), format, std::forward<Args>(args)...);
    out_ += '\n';
  }
  static std::string colour(std::size_t chain) { return kColours[chain % kColours.size()]; }
  static Place place(const json& end) {
    return {tools::text(end, "process"), tools::text(end, "node")};
  }
  std::string name(const Place& place) {
    return fmt::format("n{}", names_.try_emplace(place, names_.size()).first->second);
  }

  // Parts of a chain in two processes, which come in any order, meet where one publishes what the
  // other's first step takes.
  void add_chain(std::size_t chain) {
    const json& steps = graph_.at("chains")[chain].at("steps");
    const auto add = [&](const json& from, const json& to) {
      const Link link{place(from), place(to), tools::text(to, "topic")};
      if (!link.topic.empty()) chains_[link].push_back(colour(chain));
    };
    const auto is_same_part = [&](std::size_t i) {  // as the step before it
      return i > 0 && i < steps.size() && steps[i].at("process") == steps[i - 1].at("process");
    };
    for (std::size_t i = 0; i < steps.size(); ++i) {
      if (is_same_part(i)) {
        add(steps[i - 1], steps[i]);
        continue;
      }
      for (std::size_t last = 0; last < steps.size(); ++last) {
        if (!is_same_part(last + 1) && last != i) add(steps[last], steps[i]);
      }
    }
  }

  void draw_process(const json& process) {
    const std::string process_name = tools::text(process, "name");
    const bool is_container = process.at("container");
    line("subgraph cluster_{} {{ label={}; style=\"rounded{}\"; color=\"#404040\";", clusters_++,
         dot_string(is_container ? "process " + process_name : "another process"),
         is_container ? "" : ",dashed");
    std::map<std::string, std::vector<const json*>> nodes;  // by the executor of most callbacks
    for (const json& node : process.at("nodes")) {
      std::string main;
      std::size_t most = 0;
      for (const auto& [executor, callbacks] : node.at("callbacks").items()) {
        if (callbacks.size() <= most) continue;
        most = callbacks.size();
        main = executor;
      }
      nodes[main].push_back(&node);
    }
    for (const json& executor : process.at("executors")) {
      std::string label =
          fmt::format("{}: {}", tools::text(executor, "name"), tools::text(executor, "type"));
      if (const std::string scheduler = tools::text(executor, "scheduler"); !scheduler.empty()) {
        label += ", " + scheduler;
      }
      for (const json& thread : executor.at("threads")) label += "\n" + thread_text(thread);
      line("subgraph cluster_{} {{ label={}; style=\"rounded,filled\"; fillcolor=\"#f0f0f0\";",
           clusters_++, dot_string(label));
      const std::string name = tools::text(executor, "name");
      for (const json* node : nodes[name]) draw_node(process_name, *node, name);
      if (nodes[name].empty()) line("e{} [style=invis, width=0, height=0, label=\"\"];", clusters_);
      line("}}");
      nodes.erase(name);
    }
    for (const auto& [executor, rest] : nodes) {
      for (const json* node : rest) draw_node(process_name, *node, executor);
    }
    line("}}");
  }

  void draw_node(const std::string& process, const json& node, const std::string& executor) {
    std::string label = tools::text(node, "name");
    for (const auto& [other, callbacks] : node.at("callbacks").items()) {
      if (other == executor) continue;
      label += fmt::format("\n{}: {}", other,
                           fmt::join(callbacks.get<std::vector<std::string>>(), ", "));
    }
    line("{} [label={}];", name({process, tools::text(node, "name")}), dot_string(label));
  }

  void draw_topic(const json& topic) {
    const json &publishers = topic.at("publishers"), &subscriptions = topic.at("subscriptions");
    const std::string topic_name = tools::text(topic, "name");
    if (publishers.empty() || subscriptions.empty()) {
      const bool is_published = !publishers.empty();
      const std::string end = fmt::format("t{}", clusters_++);
      line("{} [shape=plaintext, style=\"\", fontcolor=\"{}\", label={}];", end, kRed,
           dot_string(topic_name + (is_published ? "\nno subscription" : "\nno publisher")));
      for (const json& one : is_published ? publishers : subscriptions) {
        const std::string node = name(place(one));
        line("{} -> {} [color=\"{}\", style=dashed];", is_published ? node : end,
             is_published ? end : node, kRed);
      }
      return;
    }
    if (publishers.size() * subscriptions.size() > publishers.size() + subscriptions.size()) {
      return draw_star(topic);
    }
    for (const json& from : publishers) {
      for (const json& to : subscriptions) {
        line("{} -> {} [label={}, tooltip={}{}];", name(place(from)), name(place(to)),
             dot_string(topic_name + "\n" +
                        (from.contains("rate_hz") ? rate_text(from) + ", " : "") + qos_text(to)),
             dot_string(tools::text(from, "type")), style(topic, {from}, {to}));
      }
    }
  }

  // Of many with many, all would be drawn over each other: their edges meet at the topic.
  void draw_star(const json& topic) {
    const json &publishers = topic.at("publishers"), &subscriptions = topic.at("subscriptions");
    const std::string middle = fmt::format("t{}", clusters_++);
    line("{} [shape=ellipse, label={}, tooltip={}];", middle,
         dot_string(tools::text(topic, "name")), dot_string(tools::text(publishers[0], "type")));
    const std::vector<json> all_from = publishers, all_to = subscriptions;
    for (const json& from : all_from) {
      line("{} -> {} [label={}{}];", name(place(from)), middle, dot_string(rate_text(from)),
           style(topic, {from}, all_to));
    }
    for (const json& to : all_to) {
      line("{} -> {} [label={}{}];", middle, name(place(to)), dot_string(qos_text(to)),
           style(topic, all_from, {to}));
    }
  }

  // Red if one of the pairs does not match, which is said; otherwise with the colours of chains.
  std::string style(const json& topic, const std::vector<json>& all_from,
                    const std::vector<json>& all_to) const {
    std::vector<std::string> colours;
    for (const json& from : all_from) {
      for (const json& to : all_to) {
        for (const json& mismatch : topic.at("mismatches")) {
          if (mismatch.at("from") != from.at("node") || mismatch.at("to") != to.at("node"))
            continue;
          return fmt::format(
              ", color=\"{0}\", fontcolor=\"{0}\", style=dashed, label={1}", kRed,
              dot_string(tools::text(topic, "name") + "\n" + tools::text(mismatch, "why")));
        }
        const auto chains = chains_.find({place(from), place(to), tools::text(topic, "name")});
        if (chains == chains_.end()) continue;
        colours.insert(colours.end(), chains->second.begin(), chains->second.end());
      }
    }
    std::sort(colours.begin(), colours.end());
    colours.erase(std::unique(colours.begin(), colours.end()), colours.end());
    return colours.empty() ? ""
                           : fmt::format(", color=\"{}\", penwidth=2", fmt::join(colours, ":"));
  }

  void draw_legend() {
    if (graph_.at("chains").empty()) return;
    line("subgraph cluster_{} {{ label=\"chains\"; style=rounded; color=\"#c0c0c0\";", clusters_++);
    for (std::size_t i = 0; i < graph_.at("chains").size(); ++i) {
      const json& chain = graph_.at("chains")[i];
      std::string label = tools::text(chain, "name");
      if (const double deadline_us = chain.at("deadline_us"); deadline_us != 0) {
        label += fmt::format(", deadline {:.6g} ms", deadline_us / 1000);
      }
      line("c{} [shape=plaintext, style=\"\", fontcolor=\"{}\", label={}];", i, colour(i),
           dot_string(label));
    }
    line("}}");
  }

  const json& graph_;
  std::map<Link, std::vector<std::string>> chains_;  // the colours of each link
  std::map<Place, std::size_t> names_;
  std::size_t clusters_ = 0;
  std::string out_;
};

}  // namespace

std::string dot_text(const json& graph) {
  return Drawing(graph).text();
}

void check_graphviz() {
  svg_of("digraph {}");
}

std::string svg_of(const std::string& dot) {
  const TemporaryFolder folder;
  const std::string path = folder / "picture.svg";
  const int status = feed({"dot", "-Tsvg", "-o" + path}, dot);
  if (status == kNotInstalled) {
    throw Error("pictures are laid out by graphviz, which is not installed",
                "run `apt-get install graphviz`, or write a .dot file");
  }
  if (status != 0) throw std::runtime_error("graphviz failed; see the message above");
  std::string svg = read_text(path, dot.size() * 100 + 100'000);
  svg.insert(svg.find('>', svg.find("<svg")) + 1, kDark);
  svg.insert(svg.find("?>") + 2, kMark);
  return svg;
}

std::string picture_page(const json& graph, const std::string& svg) {
  const std::string file = html(text(graph, "title"));
  return fmt::format(
      "<!DOCTYPE html>{3}\n<html lang=\"en\">\n<head><meta charset=\"utf-8\">\n<title>{0}: graph"
      "</title>\n<style>:root {{ color-scheme: light dark; }} body {{ font-family: sans-serif; "
      "margin: 1em; }} svg {{ max-width: 100%; height: auto; }} @media (prefers-color-scheme: "
      "dark) {{ body {{ background: #181818; color: #ddd; }} }}</style></head>\n<body>\n"
      "<h1>{0}</h1>\n<p>{1:%F "
      "%R}. Boxes are processes, executors with their threads, and nodes; arrows are topics with "
      "rate and QoS. Coloured arrows belong to chains; what does not match is red.</p>\n{2}\n"
      "</body>\n</html>\n",
      file, fmt::localtime(std::time(nullptr)), svg.substr(std::min(svg.size(), svg.find("<svg"))),
      kMark);
}

}  // namespace takt::tools
