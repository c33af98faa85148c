#!/usr/bin/python3
"""Do the tests see a wrong figure, or bound? Falsifies them in a copy of the tree, one after the other, builds the
tests concerned, and fails if they still pass: mutations.py [NAME...]

SPDX-License-Identifier: Apache-2.0
"""
import filecmp
import os
import shutil
import subprocess
import sys

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
COPY = os.path.join(ROOT, "build/mutants")
BIN = os.path.join(COPY, "build/release/bin")

PAGE = "tools/check/mutations.py"  # in git
OBSERVED = "executors/engine/observed.cpp"
# A test: what to build, and its command line.
STATISTICS = ("executors_test", "{bin}/executors_test", "--gtest_filter=*ConformanceStatistics*")
PAST = ("executors_test", "{bin}/executors_test", "--gtest_filter=PastThreads.*")
PHASE = ("executors_test", "{bin}/executors_test", "--gtest_filter=*KeepsItsPhase*")
HISTOGRAM = ("base_test", "{bin}/base_test", "--gtest_filter=*Histogram*")
USAGE = ("containers_test", "{bin}/containers_test", "--gtest_filter=ProcessUsage.*")
PUBLISHER = ("entities_test", "{bin}/entities_test", "--gtest_filter=PublisherTest.*")
CLOCKS = ("transport_test", "{bin}/transport_test", "--gtest_filter=WriterClocks.*")
MODEL = ("takt_cli_test", "{bin}/takt_cli_test", "--gtest_filter=Extraction.*:Model.*")
RESULTS = ("takt_cli_test", "{bin}/takt_cli_test", "--gtest_filter=ResultJson*")
SYSTEM = ("takt_cli", "{root}/tools/takt/tests/system_test.py", "{bin}/takt")
SELFTEST = ("takt_cli", "{bin}/takt", "selftest", "--executors", "events", "--transports", "dds")
# By UDP Cyclone delivers within a process on the publisher's thread; here other threads have work to do.
SHARED_MEMORY = SELFTEST[:-1] + ("shm",)
GUARANTEES = ("containers_test", "{bin}/containers_test", "--gtest_filter=Assumptions.*:Coverage.*:Guarantee.*:SystemModel.*")
BOUNDS = ("analysis_test", "/usr/bin/env", "TAKT_RANDOM_SYSTEMS=2000", "{bin}/analysis_test",
          "--gtest_filter=RandomSystems.*")

# What is wrong: file, what stands there, what stands there instead, the test that must fail.
MUTATIONS = {
    "latency times 10": (OBSERVED, "times->latency.record(latency);", "times->latency.record(10 * latency);",
                         STATISTICS),
    "latency ends with the callback before": (
        OBSERVED, "const Nanoseconds latency = at.start - slot.ready_time;",
        "const Nanoseconds latency = at.picked - slot.ready_time;", STATISTICS),
    "age of a DDS message divided by 100": (
        "transport/dds/cyclone_reader.cpp", "const TimePoint sent_at = clocks_.sent_at(handle, info);",
        "const TimePoint now = Clock::steady().now();\n"
        "      const TimePoint sent_at = now - (now - clocks_.sent_at(handle, info)) / 100;", SELFTEST),
    "late never counted": (OBSERVED, "    ++counts.late;\n", "", STATISTICS),
    "histogram off by a bucket": ("base/histogram.cpp", "seen += counts_[i];",
                                  "seen += counts_[i == 0 ? 0 : i - 1];", HISTOGRAM),
    "percentile of the wrong rank": ("base/histogram.cpp", "std::ceil(fraction *",
                                     "std::floor(0.9 * fraction *", HISTOGRAM),
    "lost halved": ("executors/executor.hpp", "? 0 : expected - served;", "? 0 : (expected - served) / 2;",
                    RESULTS),
    "memory of a child forgotten": ("tools/takt/run/processes.cpp",
                                    "    merge(all.run, one);\n",
                                    "    if (i == 0) one.processes.clear();\n    merge(all.run, one);\n",
                                    SYSTEM),
    "CPU of DDS threads forgotten": ("containers/container_result.cpp",
                                     "  thread.cpu_time += sign * usage->cpu_time;\n",
                                     "  thread.cpu_time += 0 * sign * usage->cpu_time;\n",
                                     SHARED_MEMORY),
    "chain from the wrong root": ("executors/engine/observed.hpp", "is_root ? slot.ready_time : slot.root_release",
                                  "is_root ? slot.ready_time + Nanoseconds(1000) : slot.root_release", STATISTICS),
    "phase of a timer lost": ("entities/timer.cpp",
                              "compare_exchange_weak(due, later(due + missed * period_, period_))",
                              "compare_exchange_weak(due, later(now, period_))",
                              PHASE),
    "the rest of a deadline": (OBSERVED, "const bool has_missed = end > deadline;",
                               "const bool has_missed = end > deadline + settings.info.deadline / 10;",
                               STATISTICS),
    "the rest of a budget": (OBSERVED, "end - start > budget;",
                             "end - start > budget + budget / 10;", STATISTICS),
    "the rest of a chain's deadline": ("nodes/chain.hpp", "latency > options_.deadline)",
                                       "latency > options_.deadline * 11 / 10)", STATISTICS),
    "late by a quarter": (OBSERVED, "std::min<Nanoseconds>(period / 5,", "std::min<Nanoseconds>(period / 4,",
                          STATISTICS),
    "too late by a tenth more": (OBSERVED, "std::min<Nanoseconds>(period, std::chrono::milliseconds(50))",
                                 "std::min<Nanoseconds>(period * 11 / 10, std::chrono::milliseconds(50))",
                                 STATISTICS),
    "skipped releases forgotten": (OBSERVED,
                                   "statistics.skipped = counted.missed;", "statistics.skipped = 0;", STATISTICS),
    "a timer that never ran": (OBSERVED,
                               "return due > held ? 0", "return due < held ? 0", STATISTICS),
    "served releases are all": ("measuring/run_json.cpp", "callback.statistics.received + callback.statistics.skipped;",
                                "callback.statistics.received;", RESULTS),
    "RSS shown as PSS": ("containers/process_usage.cpp", 'word == "Pss:"', 'word == "Rss:"', USAGE),
    "CPU of executors' threads halved": ("containers/container_result.cpp",
                                         "thread.cpu_time = counted->second.cpu_time;",
                                         "thread.cpu_time = counted->second.cpu_time / 2;", SELFTEST),
    "a message's time after its copy": ("entities/publisher.hpp", "publish_copy(message, stamp());",
                                        "publish_copy(message, {});", PUBLISHER),
    "preempted between two clocks": ("transport/dds/writer_clocks.hpp", "constexpr int kMostReadings = 4;",
                                     "constexpr int kMostReadings = 1;", CLOCKS),
    "the model's p99.9 of a chain is its p99": ("tools/takt/model/extraction.cpp",
                                                '{"p999", &MeasuredChain::p999}', '{"p99", &MeasuredChain::p999}',
                                                MODEL),
    "the p99.9 of a written model": ("tools/takt/model/model_output.cpp", '"p99.9", chain.p999', '"p99.9", chain.p99',
                                     MODEL),
    "the p99.9 of a shown model": ("tools/takt/model/model_output.cpp", "rt::us(chain.p999)", "rt::us(chain.p99)",
                                   MODEL),
    "the p99.9 of a run": ("measuring/row_json.cpp", "histogram.percentile(0.999)",
                           "histogram.percentile(0.99)", RESULTS),
    "the maximum of a run": ("measuring/row_json.cpp", "us(histogram.max())",
                             "us(histogram.percentile(0.999))", RESULTS),
    "spin time of a removed thread": ("executors/figures.hpp", 'sum("spin_time"', 'keep("spin_time"', PAST),
    "a key without an entry counts as used": (
        "containers/model/model_coverage.cpp", "if (entry != nullptr && entry->coverage != Coverage::not_covered) continue;",
        "if (entry == nullptr || entry->coverage != Coverage::not_covered) continue;", GUARANTEES),
    "lifecycle nodes are ignored": (
        "containers/model/model_coverage.cpp", "if (node == nullptr || says_all || measured_ != nullptr) continue;",
        "continue;", GUARANTEES),
    "reserved threads are ignored": (
        "containers/model/model_coverage.cpp", "  if (!is_realtime(own.policy)) return;",
        "  return;", GUARANTEES),
    "best effort is ignored": (
        "containers/model/model_links.cpp", "end->qos().reliability == Reliability::best_effort",
        "false", GUARANTEES),
    "lifespans are ignored": (
        "containers/model/model_bounds.cpp", "facts.lifespan != Nanoseconds::zero() &&",
        "false &&", GUARANTEES),
    "global EDF keeps what the kernel admits": (
        "containers/model/places.cpp", "m - (m - 1) * greatest",
        "m", GUARANTEES),
    "a timer that is cancelled never comes": (
        "containers/model/system_model.cpp", "return !is_alarm && !is_timeout(entity);",
        "return !is_alarm && !timer->is_canceled();", GUARANTEES),
    "arrivals that a run refutes are ignored": (
        "containers/model/system_model.cpp", "if (least <= seen[i].count()) continue;",
        "continue;", GUARANTEES),
    "executions that a run refutes are ignored": (
        "containers/model/system_model.cpp", "  if (declared >= seen) return;",
        "  return;", GUARANTEES),
    "sending takes no time": (
        "containers/model/system_model.cpp", "const Nanoseconds exact = said ? *said + sending(index)",
        "const Nanoseconds exact = said ? *said", GUARANTEES),
    "who wakes has not switched": (
        "containers/model/model_threads.cpp", "overheads.wake += overheads.context_switch;",
        "overheads.wake += 0;", GUARANTEES),
    "overheads are zero in silence": (
        "containers/model/model_machine.cpp", '? "overheads_are_zero"', '? "as_declared"', GUARANTEES),
    "other threads are ignored": (
        "containers/model/model_machine.cpp", "if (!may_meet || !(is_before || model_.system.for_realtime)) continue;",
        "continue;", GUARANTEES),
    "a budget counts as checked": (
        "containers/model/model_assumptions.cpp", "execution == Provenance::promised && !has_run",
        "false", GUARANTEES),
    "a model is from here": (
        "containers/model/model_assumptions.cpp", "if (measured_->differs.empty()) continue;",
        "continue;", GUARANTEES),
    "the start is over": (
        "containers/model/model_assumptions.cpp", "end->qos().durability == Durability::transient_local",
        "false", GUARANTEES),
    "what nobody checks is guaranteed": (
        "containers/model/model_chains.cpp", "missing(chain, bound).empty() ? Verdict::guaranteed",
        "true ? Verdict::guaranteed", GUARANTEES),
}
MUTATIONS |= {
    f"one of a hundred not recorded: {time}": (OBSERVED, f"{time}.record(",
                                               f"if (counts.executions % 100 != 0) {time}.record(", STATISTICS)
    for time in ("times->latency", "parts->waiting", "parts->take", "times->execution")
}


# Of the bounds: what a method leaves out.
MUTATIONS |= {
    name: ("analysis/" + file, there, instead, BOUNDS)
    for name, file, there, instead in [
        ("a less urgent callback blocks nobody", "methods/urgency.cpp",
         "plus(part_.blocking(longest), caused)",
         "caused"),
        ("what a less urgent callback causes", "methods/urgency.cpp",
         "plus(part_.blocking(longest), caused)",
         "part_.blocking(longest)"),
        ("an arrival too few", "methods/urgency.cpp", "own.curve.most(offset + 1)", "own.curve.most(offset)"),
        ("later instances do not overtake", "methods/urgency.cpp",
         "times(whole - each, own.curve.most(window))",
         "times(whole - each, own.curve.most(offset + 1))"),
        ("equally urgent callbacks", "methods/urgency.cpp", ".urgency >= least_", ".urgency > least_"),
        ("a later deadline blocks nobody", "methods/points.cpp",
         "std::max(longest, part.blocking(other.execution))",
         "longest"),
        ("equal deadlines", "methods/points.cpp", "offset + 1 + own_point", "offset + own_point"),
        ("jitter between executors", "analysis.cpp",
         "root.curve.with_jitter(plus(span.latest_end, held) - earliest)",
         "root.curve"),
        ("other groups take no turn", "methods/turns.cpp", "plus(execution, round)", "execution"),
        ("the rest of a snapshot", "methods/snapshots.cpp",
         "plus(times(steps, snapshot), until_last)",
         "plus(times(steps - 1, snapshot), until_last)"),
        ("a reservation never waits", "supply.cpp", "blackout = period_ - budget_", "blackout = 0"),
        ("others arrive only before", "methods/work_conserving.cpp",
         "offset + r - last.execution + 1",
         "offset + 1"),
        ("a shorter way", "methods/work_conserving.cpp", "count = times(count, messages)",
         "count = path.part.executions(path.source, path.last())"),
        ("equal priorities of threads", "supplies.cpp",
         "share->priority < mine->priority",
         "share->priority <= mine->priority"),
        ("a thread that is behind", "supply.hpp",
         "bool holds_in_any_window() const noexcept { return above_ == nullptr; }",
         "bool holds_in_any_window() const noexcept { return true; }"),
        ("a thread of the same priority", "supply.hpp", "return has_equals_;", "return false;"),
        ("a period has just ended", "methods/periods.cpp", "? period : 0", "? 0 : 0"),
        ("one message in each period", "methods/periods.cpp", "first + before * period - offset", "first"),
        ("what is sent waits for the period's end", "method.cpp", "plus(executor.let_period, lateness()) - ended",
         "Time{0} * ended"),
        ("callbacks that exceed their period", "method.cpp",
         "system.overheads.wake) <= executor.let_period", "system.overheads.wake) >= 0"),
        ("a timer's releases that were missed", "analysis.cpp", "missed / receiver.longest_gap + 1", "1"),
        ("what a join holds back", "analysis.cpp", "std::max(held, plus(waiting, ", "std::max(held, plus(0 * waiting, "),
        ("a chain waits at a join", "analysis.cpp",
         "before.wait = wait_of_join(*predecessor, before.longest_gap, output)",
         "before.wait = 0"),
        ("a join waits for its slowest input", "joins.cpp", "longest = std::max(longest, of_sender(sender, other))",
         "longest = std::max(longest, sender == from ? of_sender(sender, other) : 0)"),
        ("a join's last input sends at its end", "joins.cpp",
         "longest = std::max(longest, parts_[system_.callbacks[sender].executor].longest_held())",
         "longest = std::max(longest, parts_[system_.callbacks[sender].executor].longest_held() * 0)"),
        ("threads share nothing", "methods/pools.cpp", "(shared + threads - 1) / threads", "0 * shared"),
        ("threads wake up at once", "analysis.cpp", "plus(answer.bound, system_.overheads.wake)", "answer.bound"),
        ("a dispatch takes no time", "analysis.cpp", "plus(callback.execution, given.overheads.dispatch)",
         "callback.execution"),
        ("arrival as a callback begins", "method.cpp",
         "return is_closed ? std::max<Time>(0, execution - 1) : execution;",
         "return std::max<Time>(0, execution - 1);"),
    ]
}

# Random systems hardly ever have joins where these matter.
MUTATIONS |= {
    name: ("analysis/joins.cpp", there, instead, ("analysis_test", "{bin}/analysis_test", "--gtest_filter=Analysis.AJoin*"))
    for name, there, instead in [
        ("the response of a join's other inputs", "part.spans[source].at(callback).latest_end", "Time{0}"),
        ("one other input of a join", "others = std::max(others, next_end(sender))", "others = next_end(sender)"),
        ("messages that do not come to a join", "parts_[described.executor].backlog(*from) > *described.depth", "false"),
    ]
}

# Of programs for rclcpp: defects that there once were. The programs of the fuzzer find them, and a test of each.
SEQUENCES = ("rclcpp_test", "{bin}/rclcpp_test", "--gtest_filter=RclcppSequences.*")
LISTS = ("entities_test", "{bin}/entities_test", "--gtest_filter=CallbackList.*")
LAYER = ("rclcpp_test", "{bin}/rclcpp_test", "--gtest_filter=Shutdown.*:Removals.*:SimulatedTime.*:Topics.*:Executors.*:Nodes.*")
WAIT_SETS = ("executors_test", "{bin}/executors_test", "--gtest_filter=WaitSet.*")
ACTIONS = ("ros2_test", "{bin}/ros2_test", "--gtest_filter=ActionClientTest.*")
GATES = ("nodes_test", "{bin}/nodes_test", "--gtest_filter=CallbackGate.*:NodeListeners.*")
DEFECTS = {
    "pruning forgets newer requests": ("rclcpp/include/rclcpp/client.hpp", "sent_.erase(first, sent_.end());",
                                       "sent_.clear();", [SEQUENCES, LAYER]),
    "a removed callback is called": ("entities/callback_list.cpp", "if ((state & kRemoved) != 0) return false;", "",
                                     [SEQUENCES, LISTS, LAYER]),
    "a removal waits for no call": ("entities/callback_list.cpp", "wait.is_for_itself() || is_gone()", "true",
                                    [LISTS, LAYER]),
    "everybody who shuts down calls": ("rclcpp/src/context.cpp", "is_valid() && !is_ending_.exchange(true)",
                                       "is_valid()", [SEQUENCES, LAYER]),
    "who shuts down second does not wait": ("rclcpp/src/context.cpp", "    wait_for_shutdown();\n    return false;",
                                            "    return false;", [SEQUENCES, LAYER]),
    "a node that was removed is removed again": ("rclcpp/include/rclcpp/executor.hpp", "executor_.release(node_)",
                                                 "executor_.remove_node(node_, false)", [SEQUENCES, LAYER]),
    "a timer is cancelled afterwards": (
        "nodes/node.cpp", "  if (!autostart) timer->cancel();  // before an executor has it\n"
        "  return adopt_timer(std::move(timer));",
        "  auto made = adopt_timer(std::move(timer));\n  if (!autostart) made->cancel();\n  return made;",
        [SEQUENCES, LAYER]),
    "an addition wakes no wait set": ("executors/wait_set.cpp",
                                      "wake();  // it may be ready, or due sooner than what the thread waits for", "",
                                      [SEQUENCES, WAIT_SETS, LAYER]),
    "a sleep goes on by another source": ("rclcpp/src/clock.cpp", "if (!left) return false;", "if (!left) continue;",
                                          [SEQUENCES, LAYER]),
    "callbacks of a goal overlap": ("ros2/action_client.hpp", "if (is_answering) handle->calls().begin();", "",
                                    [ACTIONS]),
    "gates wait for each other": ("nodes/callback_gate.cpp", "if (wait.is_for_itself()) return false;", "", [GATES]),
}
MUTATIONS |= {f"{name} ({test[0]} {number})": (path, there, instead, test)
              for name, (path, there, instead, tests) in DEFECTS.items() for number, test in enumerate(tests, 1)}


def run(words, **options):
    return subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)


def copy_tree():
    """What git knows, as it is now; what has not changed stays, so that the next time builds little."""
    for name in run(["git", "ls-files"], cwd=ROOT).stdout.split("\n"):
        source, copy = os.path.join(ROOT, name), os.path.join(COPY, name)
        if not os.path.isfile(source):
            continue
        if not os.path.exists(copy) or not filecmp.cmp(source, copy, shallow=False):
            os.makedirs(os.path.dirname(copy), exist_ok=True)
            shutil.copy(source, copy)  # with a new time, or what was built of a mutant that was not undone would stay


def build(target):
    environment = dict(os.environ, CCACHE_BASEDIR=COPY, CCACHE_NOHASHDIR="1",
                       CMAKE_CXX_COMPILER_LAUNCHER="ccache")
    if not os.path.exists(os.path.join(COPY, "build/release/build.ninja")):
        run(["cmake", "--preset", "release"], cwd=COPY, env=environment)
    built = run(["cmake", "--build", "--preset", "release", "--target", target], cwd=COPY, env=environment)
    if built.returncode != 0:
        sys.exit(built.stdout[-3000:] + f"\n{target} does not build")


def passes(test):
    build(test[0])
    try:
        return run([word.format(bin=BIN, root=COPY) for word in test[1:]], timeout=600).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def main():
    names = sys.argv[1:] or list(MUTATIONS)
    unknown = [name for name in names if name not in MUTATIONS]
    if unknown:
        sys.exit(f"no mutation {unknown}; there are: {', '.join(MUTATIONS)}")
    copy_tree()
    for test in sorted({MUTATIONS[name][3] for name in names}):
        if not passes(test):
            sys.exit(f"{' '.join(test[1:])} fails without a mutation")
    missed = []
    for name in names:
        path, right, wrong, test = MUTATIONS[name]
        path = os.path.join(COPY, path)
        with open(path, encoding="utf-8") as file:
            text = file.read()
        if text.count(right) != 1:
            sys.exit(f"{name}: '{right}' stands {text.count(right)} times in {path}; adapt the mutation")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text.replace(right, wrong))
        try:
            is_seen = not passes(test)
        finally:
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        print(f"{'seen  ' if is_seen else 'MISSED'} {name}: {' '.join(test[1:])}", flush=True)
        if not is_seen:
            missed.append(name)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
