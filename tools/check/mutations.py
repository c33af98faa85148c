"""What mutants.py falsifies, and which tests must see it.

A mutation is a file, what stands there once, what stands there instead, and a test, or a list of tests that must all
fail. What it replaces is marked: «an expression», by another of its type, or ‹statements›, by others or by none. So one
build has all mutants, and an environment variable chooses one. Without a mark it is text, such as of a constant: that
mutant has a build of its own.

SPDX-License-Identifier: Apache-2.0
"""
import re

PAGE = "tools/check/mutations.py"  # in git


def plain(there):
    """What stands in the file."""
    return re.sub("[«»‹›]", "", there)


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
GUARANTEES = ("containers_test", "{bin}/containers_test", "--gtest_filter=Assumptions.*:Coverage.*:Guarantee.*:SystemModel.*:*Traps.*:Keys.*")
BOUNDS = ("analysis_test", "/usr/bin/env", "TAKT_RANDOM_SYSTEMS=10000", "{bin}/analysis_test",
          "--gtest_filter=RandomSystems.*")

# What is wrong: file, what stands there, what stands there instead, the test that must fail.
MUTATIONS = {
    "latency times 10": (OBSERVED, "‹all.latency.record(latency);›", "all.latency.record(10 * latency);",
                         STATISTICS),
    "latency ends with the callback before": (
        OBSERVED, "const Nanoseconds latency = «at.start - slot.ready_time»;", "at.picked - slot.ready_time", STATISTICS),
    "age of a DDS message divided by 100": (
        "transport/dds/cyclone_reader.cpp", "const Arrival arrival{next_sequence(), «times.sent»};",
        "Clock::steady().now() - (Clock::steady().now() - times.sent) / 100", SELFTEST),
    "late never counted": (OBSERVED, "‹    ++counts.late;›", "", STATISTICS),
    "histogram off by a bucket": ("base/histogram.cpp", "seen += «counts_[i]»;", "counts_[i == 0 ? 0 : i - 1]", HISTOGRAM),
    "percentile of the wrong rank": ("base/histogram.cpp", "«std::ceil(fraction * held)»",
                                     "std::floor(0.9 * fraction * held)", HISTOGRAM),
    "lost halved": ("executors/executor.hpp", "? 0 : «expected - served»;", "(expected - served) / 2",
                    RESULTS),
    "memory of a child forgotten": ("tools/takt/run/processes.cpp", "‹    merge(all.run, one);›",
                                    "if (i == 0) one.processes.clear();\nmerge(all.run, one);",
                                    SYSTEM),
    "CPU of DDS threads forgotten": ("containers/measured_usage.cpp",
                                     "thread.cpu_time += «sign * usage->cpu_time»;",
                                     "0 * sign * usage->cpu_time",
                                     SHARED_MEMORY),
    "chain from the wrong root": ("executors/engine/observed.hpp", "«is_root ? slot.ready_time : slot.root_release»",
                                  "is_root ? slot.ready_time + Nanoseconds(1000) : slot.root_release", STATISTICS),
    "phase of a timer lost": ("entities/timer.cpp",
                              "compare_exchange_weak(due, «later(due + missed * period_, period_)»)", "later(now, period_)",
                              PHASE),
    "the rest of a deadline": (OBSERVED, "has_missed = «end > deadline»;",
                               "end > deadline + settings.info.deadline / 10",
                               STATISTICS),
    "the rest of a budget": (OBSERVED, "«end - start > budget»;", "end - start > budget + budget / 10", STATISTICS),
    "the rest of a chain's deadline": ("nodes/chain.hpp", "«latency > options_.deadline»)",
                                       "latency > options_.deadline * 11 / 10", STATISTICS),
    "late by a quarter": (OBSERVED, "std::min<Nanoseconds>(«period / 5»,", "period / 4",
                          STATISTICS),
    "too late by a tenth more": (OBSERVED, "std::min<Nanoseconds>(«period», std::chrono::milliseconds(50))", "period * 11 / 10",
                                 STATISTICS),
    "skipped releases forgotten": (OBSERVED,
                                   "statistics.skipped = «counted.missed»;", "0u", STATISTICS),
    "a timer that never ran": (OBSERVED,
                               "return «due > held» ? 0", "due < held", STATISTICS),
    "served releases are all": ("measuring/run_json.cpp",
                                "«callback.statistics.received + callback.statistics.skipped»;",
                                "callback.statistics.received", RESULTS),
    "RSS shown as PSS": ("containers/process_usage.cpp", '«word == "Pss:"»', 'word == "Rss:"', USAGE),
    "CPU of executors' threads halved": ("containers/measured_usage.cpp",
                                         "thread.cpu_time = «counted->second.cpu_time»;", "counted->second.cpu_time / 2", SELFTEST),
    "a message's time after its copy": ("entities/publisher.hpp", "‹publish_copy(message, stamp());›",
                                        "publish_copy(message, {});", PUBLISHER),
    "preempted between two clocks": ("transport/dds/writer_clocks.hpp", "constexpr int kMostReadings = 4;",
                                     "constexpr int kMostReadings = 1;", CLOCKS),
    "the model's p99.9 of a chain is its p99": ("tools/takt/model/extraction.cpp",
                                                '«&MeasuredChain::p999»', '&MeasuredChain::p99',
                                                MODEL),
    "the p99.9 of a written model": ("tools/takt/model/model_output.cpp", '"p99.9", «chain.p999»', 'chain.p99',
                                     MODEL),
    "the p99.9 of a shown model": ("tools/takt/model/model_output.cpp", "rt::us(«chain.p999»)", "chain.p99",
                                   MODEL),
    "the p99.9 of a run": ("measuring/row_json.cpp", "histogram.percentile(«0.999»)", "0.99", RESULTS),
    "the maximum of a run": ("measuring/row_json.cpp", "us(«histogram.max()»)",
                             "histogram.percentile(0.999)", RESULTS),
    "spin time of a removed thread": ("executors/figures.hpp", 'sum("spin_time"', 'keep("spin_time"', PAST),
    "ignored: an executor type: takes_band": (
        "containers/model/model_threads.cpp", "‹model_.system.executors[part].levels = own.size();›", "", GUARANTEES),
    "ignored: an executor type: keys": (
        "containers/model/model_coverage.cpp", "‹if (entry != nullptr && entry->coverage != Coverage::not_covered) continue;›",
        "if (entry == nullptr || entry->coverage != Coverage::not_covered) continue;", GUARANTEES),
    "ignored: change: lifecycle transition": (
        "containers/model/model_coverage.cpp", "‹if (node == nullptr || takt::says_all(member)) continue;›",
        "continue;", GUARANTEES),
    "ignored: a reserved thread: main": (
        "containers/model/model_coverage.cpp", "‹  if (!is_realtime(own.policy)) return;›",
        "  return;", GUARANTEES),
    "best effort is ignored": ("containers/model/model_links.cpp", "«end->qos().reliability == Reliability::best_effort»", "false", GUARANTEES),
    "ignored: QoS: lifespan": ("containers/model/model_bounds.cpp", "«facts.lifespan» &&", "false", GUARANTEES),
    "global EDF keeps what the kernel admits": (
        "containers/model/places.cpp", "«m - (m - 1) * greatest»",
        "m", GUARANTEES),
    "a timer that is cancelled never comes": (
        "containers/model/system_model.cpp", "‹return !is_alarm && !is_timeout(entity) && !is_expiry(entity, *callbacks_[callback]->node);›",
        "return !is_alarm && !timer->is_canceled();", GUARANTEES),
    "arrivals that a run refutes are ignored": (
        "containers/model/model_arrivals.cpp", "‹if (least <= seen[i].count()) continue;›",
        "continue;", GUARANTEES),
    "executions that a run refutes are ignored": (
        "containers/model/system_model.cpp", "‹  if (declared >= seen) return;›", "  return;", GUARANTEES),
    "sending takes no time": ("containers/model/system_model.cpp", "*said + «sending(index)» + taken", "Nanoseconds(0)", GUARANTEES),
    "reading takes no time": ("containers/model/system_model.cpp", "Nanoseconds taken = «taking(index)»;", "Nanoseconds(0)", GUARANTEES),
    "a period's sending takes no time": ("analysis/method.cpp", "Time result = «executor.sending»;", "0", GUARANTEES),
    "who wakes has not switched": (
        "containers/model/model_threads.cpp", ".count() + «overheads.context_switch»;", "0", GUARANTEES),
    "overheads are zero in silence": (
        "containers/model/model_machine.cpp", '? «"overheads_are_zero"»', '"as_declared"', GUARANTEES),
    "ignored: change: a process is restarted": (
        "containers/model/model_assumptions.cpp", "if («processes_.size() > 1») {", "false", GUARANTEES),
    "ignored: change: a component is unloaded": (
        "containers/model/model_assumptions.cpp", "‹  if (!is_closed()) add_what_others_may_change();›", "", GUARANTEES),
    "ignored: callback parameters: on_deadline_miss": (
        "containers/model/model_bounds.cpp", "«!limit || !executors.contains(callback.executor)») continue;", "true", GUARANTEES),
    "ignored: change: somebody changes a thread from outside": (
        "containers/model/model_machine.cpp", "‹if (!may_meet || !(is_before || model_.system.for_realtime)) continue;›",
        "continue;", GUARANTEES),
    "a budget counts as checked": (
        "containers/model/model_assumptions.cpp", "«execution == Provenance::promised && !has_run»",
        "false", GUARANTEES),
    "a model is from here": (
        "containers/model/model_measured.cpp", "‹if (measured_->differs.empty()) return;›", "return;", GUARANTEES),
    "a period says how often code releases a timer": (
        "containers/model/system_model.cpp", "timer == nullptr || «sets != nullptr»",
        "false", GUARANTEES),
    "a component makes no publisher later": (
        "containers/model/model_assumptions.cpp", "‹      add(\"{} makes no publisher later, and has no other node: what that sends may come to any \"\n          \"callback\",\n          {});›", "", GUARANTEES),
    "the start is over": (
        "containers/model/model_assumptions.cpp", "«end->qos().durability == Durability::transient_local»",
        "false", GUARANTEES),
    "what receivers lost, others got": ("containers/model/model_arrivals.cpp", "is_incomplete && «topic.lost_by_all() == 0»", "true", GUARANTEES),
    "a run shows what goes to other processes": ("containers/model/model_assumptions.cpp", "return «process_of(output.to) == process_of(i)» &&", "true", GUARANTEES),
    "sentences that nobody has read": ("containers/model/model_assumptions.cpp", "«sentences == digest_of(assumption)»", "true", GUARANTEES),
    "results of actions expire hourly": ("containers/model/system_model.cpp", "«!is_expiry(entity, *callbacks_[callback]->node)»", "true", GUARANTEES),
    "what nobody checks is guaranteed": (
        "containers/model/model_chains.cpp", "«missing(chain, bound).empty()» ? Verdict::guaranteed", "true", GUARANTEES),
}
# Of the table of what a guarantee rests on: what is neither a key of the file nor a figure of a model, ignored.
LINKS, THREADS, ARRIVALS, MODEL_PARTS = ("containers/model/model_links.cpp", "containers/model/model_threads.cpp", "containers/model/model_arrivals.cpp",
                               "containers/model/system_model.cpp")
REFUSES = "policy = «publisher.qos.refuses(end->qos())»;"
MUTATIONS |= {
    f"ignored: {name}": (path, there, instead, GUARANTEES)
    for name, path, there, instead in [
        *[(f"QoS: {policy}", LINKS, REFUSES,
           f'publisher.qos.refuses(end->qos()) == "{policy}" ? std::string_view() : publisher.qos.refuses(end->qos())')
          for policy in ("reliability", "durability", "liveliness", "deadline", "lease_duration")],
        ("QoS: depth", THREADS, "facts.depth = «end->qos().depth»;", "std::size_t{0}"),
        ("publisher options: loans", LINKS, "if («loans == 0») return;", "true"),
        ("publisher options: published_by", LINKS, "may_send = «names.empty() || is_declared || topics_.at_once(from, to).has_value()»;", "true"),
        ("publisher options: joins", LINKS, "output.waits = «way.joins»;", "false"),
        ("trigger options: most_outputs", LINKS, "«outputs[i] <= most» ||", "true"),
        ("an executor type: readiness", THREADS, "executor.is_wait_set = «traits.readiness == Readiness::wait_set»;", "false"),
        ("an executor type: scheduler", THREADS, "description->scheduler.empty() ? «traits.scheduler» :",
         'std::string("fifo")'),
        ("an executor type: max_threads", THREADS, "own.resize(std::min(own.size(), «traits.max_threads»));", "SIZE_MAX"),
        ("an executor type: pool", THREADS, "«traits.pool» ? std::max", "false"),
        ("an executor type: isolates", THREADS, "if («!traits.isolates») {", "true"),
        ("an executor type: triggered", THREADS, "«traits.rule != nullptr && !traits.triggered»", "traits.rule != nullptr"),
        ("an executor type: rule", THREADS, "«traits.rule != nullptr && !traits.triggered»", "false"),
        ("an executor type: workers", THREADS, "«traits.workers != nullptr»", "false"),
        ("a scheduler type: order", THREADS, "executor.order = «schedulers().traits(scheduler).order»;",
         "analysis::Order::by_urgency"),
        ("a scheduler type: point", MODEL_PARTS, "point = «traits.point != nullptr» ?", "false"),
        ("a kind of entity: timer", ARRIVALS, "described.longest_gap = «entity.period().count()»;", "analysis::Time{1}"),
        ("a kind of entity: subscription", LINKS, "if («kind == EntityKind::subscription») link_publishers", "false"),
        ("a kind of entity: service", LINKS, "if («kind == EntityKind::service») link_callers", "false"),
        ("a kind of entity: client", LINKS, "if («kind == EntityKind::client») link_answers", "false"),
        ("a kind of entity: waitable", ARRIVALS, "may_be_called = «!is_receiver || joins_dds()»;", "joins_dds()"),
        ("change: a callback is made later", "containers/model/model_assumptions.cpp",
         "‹  add_what_nodes_may_make();›", ""),
        ("change: a peer comes to a topic", "containers/model/model_assumptions.cpp",
         "«is_closed() && !process_of(i)->is_program») continue;", "true"),
        ("change: simulated time is switched on", MODEL_PARTS,
         "«simulated != nullptr && simulated->simulates()»", "false"),
    ]
}
OF_COMMAND = ("takt_cli", "{root}/tools/takt/tests/analyze_test.py", "{bin}/takt")
PLACING = ("containers_test", "{bin}/containers_test", "--gtest_filter=*Guarantee*:Loading*:*Changes*:*Parameters*:*Manager*")
MUTATIONS |= {
    "ignored: a measured model: file": ("tools/takt/analyze/analyzed_file.cpp",
                                        "«!model.file.empty()» && name(model.file)", "false", OF_COMMAND),
    "ignored: a measured model: machine": ("tools/takt/analyze/analyzed_file.cpp",
                                           "«rt::lasting_part(model.machine) != here»", "false", OF_COMMAND),
    "ignored: a measured model: executors": ("tools/takt/analyze/analyzed_file.cpp",
                                             "‹  if (why.empty()) return;›", "  return;", OF_COMMAND),
    "ignored: a measured model: components": ("tools/takt/analyze/analyzed_file.cpp",
                                              "«seen->digest != component.digest»", "false", OF_COMMAND),
    "ignored: a measured model: settings": ("tools/takt/analyze/analyzed_file.cpp",
                                            "settings = «measured_settings(file.system)»;", "model.settings", OF_COMMAND),
    "ignored: change: a callback gets other parameters": (
        "containers/container_loading.cpp", "const Guarantees::Errors errors = «guarantees_->lost_by(changes)»;", "Guarantees::Errors()", GUARANTEES),
    "ignored: change: a component is loaded": (
        "containers/container_loading.cpp", "Guarantees::Errors errors = «guarantees_->lost_by(*loaded)»;", "Guarantees::Errors()", PLACING),
}
MUTATIONS |= {
    f"one of a hundred not recorded: {time}": (OBSERVED, f"‹{time}.record({value});›",
                                               f"if (counts.executions % 100 != 0) {time}.record({value});",
                                               STATISTICS)
    for time, value in (("all.latency", "latency"), ("parts.waiting", "at.picked - slot.ready_time"),
                        ("parts.take", "at.start - at.picked"), ("all.execution", "at.end - at.start"))
}


# Of the bounds: what a method leaves out.
MUTATIONS |= {
    name: ("analysis/" + file, there, instead, BOUNDS)
    for name, file, there, instead in [
        ("a less urgent callback blocks nobody", "methods/urgency.cpp",
         "«plus(part_.blocking(longest), caused)»",
         "caused"),
        ("what a less urgent callback causes", "methods/urgency.cpp",
         "«plus(part_.blocking(longest), caused)»",
         "part_.blocking(longest)"),
        ("an arrival too few", "methods/urgency.cpp", "«own.curve.most(offset + 1)»", "own.curve.most(offset)"),
        ("later instances do not overtake", "methods/urgency.cpp",
         "«times(whole - each, own.curve.most(window))»",
         "times(whole - each, own.curve.most(offset + 1))"),
        ("equally urgent callbacks", "methods/urgency.cpp", "«part_.at(callback).urgency >= least_»", "part_.at(callback).urgency > least_"),
        ("a later deadline blocks nobody", "methods/points.cpp",
         "«std::max(longest, part.blocking(other.longest))»",
         "longest"),
        ("equal deadlines", "methods/points.cpp", "«offset + 1 + own_point - other.point»", "offset + own_point - other.point"),
        ("jitter between executors", "analysis.cpp",
         "«root.curve.with_jitter(jitter)»",
         "root.curve"),
        ("other groups take no turn", "methods/turns.cpp", "«plus(execution, round)»", "execution"),
        ("the rest of a snapshot", "methods/snapshots.cpp",
         "«plus(times(steps, snapshot), until_last)»",
         "plus(times(steps - 1, snapshot), until_last)"),
        ("a reservation never waits", "supply.cpp", "blackout = «period_ - budget_»", "0"),
        ("others arrive only before", "methods/work_conserving.cpp",
         "«std::max(until - last.execution, offset)»",
         "offset"),
        ("a shorter way", "methods/work_conserving.cpp", "count = «times(count, messages)»",
         "path.part.executions(path.source, path.last())"),
        ("equal priorities of threads", "system.hpp",
         "meets(other) && «other.priority >= priority»",
         "other.priority > priority"),
        ("as many rivals as CPUs", "system.cpp", "«found.size() < mine->cpus.size()»", "found.size() <= mine->cpus.size()"),
        ("a reservation's two budgets", "supplies.cpp", "«plus(share, times(2, reservation.budget))»", "share"),
        ("a thread that is behind", "supply.hpp",
         "return «above_ == nullptr»;", "true"),
        ("a thread of the same priority", "supply.hpp", "return «has_equals_»;", "false"),
        ("a period has just ended", "methods/periods.cpp", "? «period» : 0", "0"),
        ("one message in each period", "methods/periods.cpp", "«first + before * period - offset»", "first"),
        ("what is sent waits for the period's end", "method.cpp", "between(ended, «plus(executor.let_period, lateness())»)",
         "ended"),
        ("callbacks that exceed their period", "method.cpp",
         "«plus(supply.time_for(snapshot(), limit), system.overheads.wake) <= executor.let_period»", "true"),
        ("what a join holds back", "analysis.cpp", "std::max(held, plus(«waiting», ", "0 * waiting"),
        ("a chain waits at a join", "analysis.cpp",
         "before.wait = «wait_of_join(*predecessor, before.longest_gap, output)»", "0"),
        ("a join waits for its slowest input", "joins.cpp", "std::max(longest, «of_sender(sender, other)»)",
         "sender == from ? of_sender(sender, other) : 0"),
        ("a join's last input sends at its end", "joins.cpp",
         "std::max(longest, «parts_[system_.callbacks[sender].executor].longest_held()»)", "0"),
        ("threads share nothing", "methods/workload.cpp", "«waiting.of_others(window) / threads»", "0 * threads"),
        ("less urgent ones have not begun", "methods/workload.cpp",
         "‹for (const Time execution : less_urgent) result = plus(result, execution);›", ""),
        ("threads wake up at once", "analysis.cpp", "«plus(answer.bound, system_.overheads.wake)»", "answer.bound"),
        ("a dispatch takes no time", "analysis.cpp", "«plus(dispatch, executor.more_dispatch)»",
         "executor.more_dispatch"),
        ("arrival as a callback begins", "method.cpp",
         "«is_closed ? std::max<Time>(0, execution - 1) : execution»", "std::max<Time>(0, execution - 1)"),
    ]
}

# Random systems hardly ever have threads and joins where these matter.
MUTATIONS |= {
    name: ("analysis/" + file, there, instead, ("analysis_test", "{bin}/analysis_test", "--gtest_filter=Analysis.AThread*:Analysis.AJoin*"))
    for name, file, there, instead in [
        ("a timer's releases that were missed", "analysis.cpp", "«missed / receiver.longest_gap + 1»", "1"),
        ("what a thread of several CPUs has left over", "supplies.cpp", "«plus(window, other->busy)», 0)", "window"),
        ("what is there when it arrives", "methods/workload.cpp", "std::max<Time>(1, «plus(until, before)»)", "until"),
        ("further threads wake up at once", "methods/workload.cpp", "«times(part.system.overheads.wake, threads - 1)»", "0"),
        ("the first and the last of a workload", "methods/workload.cpp", "«std::clamp<Time>(ends, each, times(2, each))»", "each"),
    ]
}

# Random systems hardly ever have joins where these matter.
MUTATIONS |= {
    name: ("analysis/joins.cpp", there, instead, ("analysis_test", "{bin}/analysis_test", "--gtest_filter=Analysis.AJoin*"))
    for name, there, instead in [
        ("the response of a join's other inputs", "«part.spans[source].at(callback).latest_end»", "Time{0}"),
        ("one other input of a join", "others = «std::max(others, next_end(sender))»", "next_end(sender)"),
        ("messages that do not come to a join", "«parts_[described.executor].backlog(*from) > *described.depth»", "false"),
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
    "pruning forgets newer requests": ("rclcpp/include/rclcpp/client.hpp", "«is_meant(time)»", "true",
                                       [SEQUENCES, LAYER]),
    "a removed callback is called": ("entities/callback_list.cpp", "‹if ((state & kRemoved) != 0) return false;›", "",
                                     [SEQUENCES, LISTS, LAYER]),
    "a removal waits for no call": ("entities/callback_list.cpp", "«wait.is_for_itself() || is_gone()»", "true",
                                    [LISTS, LAYER]),
    "everybody who shuts down calls": ("rclcpp/src/context.cpp", "«is_valid() && !is_ending_.exchange(true)»",
                                       "is_valid()", [SEQUENCES, LAYER]),
    "who shuts down second does not wait": ("rclcpp/src/context.cpp", "‹    wait_for_shutdown();›\n    return false;", "", [SEQUENCES, LAYER]),
    "a node that was removed is removed again": ("rclcpp/include/rclcpp/executor.hpp", "{ ‹executor_.release(node_);› }",
                                                 "executor_.remove_node(node_, false);", [SEQUENCES, LAYER]),
    "a timer is cancelled afterwards": (
        "nodes/node.cpp", "‹  if (!autostart) timer->cancel();  // before an executor has it\n"
        "  return adopt_timer(std::move(timer));›",
        "  auto made = adopt_timer(std::move(timer));\n  if (!autostart) made->cancel();\n  return made;",
        [SEQUENCES, LAYER]),
    "an addition wakes no wait set": ("executors/wait_set.cpp",
                                      "‹wake();  // it may be ready, or due sooner than what the thread waits for›", "",
                                      [SEQUENCES, WAIT_SETS, LAYER]),
    "a sleep goes on by another source": ("rclcpp/src/clock.cpp", "‹if (!left) return false;›", "if (!left) continue;",
                                          [SEQUENCES, LAYER]),
    "callbacks of a goal overlap": ("ros2/action_client.hpp", "‹if (is_answering) handle->calls().begin();›", "",
                                    [ACTIONS]),
    "gates wait for each other": ("nodes/callback_gate.cpp", "‹if (wait.is_for_itself()) return false;›", "", [GATES]),
}
MUTATIONS |= DEFECTS

# What a defect of a line would do in a running system: by the library that has it.
KIT = ("kit_test", "{bin}/kit_test")
CONTAINERS = ("containers_test", "{bin}/containers_test", "--gtest_filter=-LoadSoak*:ReleasePrograms*")
PARAMETERS = ("ros2_test", "{bin}/ros2_test", "--gtest_filter=Parameter*")
SERVERS = ("ros2_test", "{bin}/ros2_test", "--gtest_filter=ActionServer*:ActionClient*")
RCLCPP = ("rclcpp_test", "{bin}/rclcpp_test", "--gtest_filter=-RclcppSequences.*:Storm*")


def conformance(*suites):
    return ("executors_test", "{bin}/executors_test",
            "--gtest_filter=" + ":".join(f"*Conformance{suite}*/{executor}" for suite in suites for executor in
                                         ("events__fifo", "events__fixed_priority", "multi_threaded__fifo")))


MUTATIONS |= {
    name: ("executors/" + path, there, instead, test)
    for name, path, there, instead, test in [
        # These three once survived.
        ("an update unparks nothing", "engine/ready_set.cpp",
         "‹    queue_.unpark(exclusion->unpark());  // the one handed back before may have been removed›", "", KIT),
        ("the watchdog aborts no chain", "engine/observed.cpp",
         "«chain_instance != 0 && overrun == OverrunPolicy::abort»", "false", KIT),
        ("a reservation's deadline is its period", "isolated_executor.cpp",
         "thread.deadline = «parameters.deadline.value_or(thread.deadline)»", "thread.deadline", KIT),

        ("a callback with more is not ready again", "engine/dispatcher.cpp",
         "ready_.finished(record, «execution.slot.more»);", "false", conformance("Action")),
        ("held timers run", "engine/ready_set.cpp", "if («timers_.timers_are_held()») return;\n  TimePoint due;", "false",
         conformance("Time")),
        ("a demoted callback stays as urgent", "engine/observed.cpp",
         "is_demoted = «is_bad && policy == OverrunPolicy::demote»", "false", conformance("Overrun")),
        ("skipped releases are served", "engine/observed.cpp",
         "‹  if (is_bad && policy == OverrunPolicy::skip) entity->skip_releases(end);›", "", conformance("Overrun")),
        ("an aborted chain goes on", "engine/observed.cpp",
         "is_aborted = «is_bad && policy == OverrunPolicy::abort»", "false", conformance("Overrun")),
        ("an exceeded budget is not counted", "engine/observed.cpp", "‹  if (is_over_budget) ++counts.overruns;›", "",
         conformance("Overrun")),
        ("a handler hears of a miss twice", "engine/observed.cpp", "has_missed && «!is_reported» &&", "true",
         conformance("Overrun")),
        ("the root of a chain is its last message", "engine/record.hpp",
         "root_ready_time = «arrival.root_time != TimePoint{} ? arrival.root_time : arrival.ready_time»",
         "arrival.ready_time", KIT),
        ("what a rule has put aside stays there", "engine/rule_step.cpp",
         "‹ready_.queue().hand_back_all(ready_.selection().take_held());›", "", KIT),
        ("a rule hears of no execution", "engine/dispatcher.cpp",
         "‹rule_->done(callback, label, times.end - times.start);›", "", KIT),
        ("each thread takes what is for others", "engine/selection.cpp",
         "worker == kAnyWorker || «(record.settings.workers >> worker & 1) != 0»", "true", KIT),
        ("nobody waits for the opening of a rule", "engine/selection.cpp",
         "return «is_awaited» ? std::min", "false", KIT),
        ("the timer registered last runs first", "engine/timer_queue.cpp", "«a.second->id() > b.second->id()»",
         "a.second->id() < b.second->id()",
         ("executors_test", "{bin}/executors_test", "--gtest_filter=TimerQueue.*")),
        ("what came before is counted by the next executor", "engine/observed.cpp",
         "counted_before = «entity->answered()»", "Entity::Counts{}", conformance("Statistics")),
        ("an exception of a callback is lost", "engine/dispatcher.cpp",
         "if («exception_ == nullptr») exception_ = exception;", "false", conformance("Spin", "Lifetime", "Graph")),
    ]
}
MUTATIONS |= {
    name: ("containers/" + path, there, instead, CONTAINERS)
    for name, path, there, instead in [
        ("a library of a sibling folder may be loaded", "load_policy.cpp", "return «std::mismatch(folder.begin(), "
         "folder.end(), library.begin(), library.end()).first ==\n         folder.end()»", "library.string().starts_with(folder.string())"),
        ("a process with privileges loads", "load_policy.cpp", "if («privileges.empty()») return;", "true"),
        ("what lies beneath a folder is trusted", "load_policy.cpp", "if («!is_trusted») check_beneath", "false"),
        ("a node is up before what it depends on", "lifecycle_manager.cpp",
         "«find(name).state == LifecycleState::active»", "true"),
        ("dependents of a lost node go on", "lifecycle_manager.cpp",
         "«description_.on_loss == LifecycleDescription::OnLoss::deactivate_dependents»", "false"),
        ("a lost node brings nothing down", "lifecycle_manager.cpp",
         "if («description_.on_loss == LifecycleDescription::OnLoss::shutdown») target_", "false"),
        ("a bring-up goes on after a failure", "lifecycle_manager.cpp",
         "state == LifecycleState::active || «(was_up && (is_lost || has_failed || !waits))»", "true"),
        ("counters that went back are rates", "statistics_interval.cpp", "now - «std::min(now, before)»", "before"),
        ("the longest period is the most critical", "planning/plan.cpp", "return «period_of(a) < period_of(b)»",
         "period_of(a) > period_of(b)"),
        ("a topic with both sides has one", "one_sided_topics.cpp",
         "«(!nodes.publishing.empty() && !nodes.subscribing.empty())»", "false"),
    ]
}
MUTATIONS |= {
    name: (path, there, instead, test)
    for name, path, there, instead, test in [
        ("parameters are set one by one", "ros2/parameter_services.cpp",
         "response.result = «set(node, request.parameters, failure)»", "set(node, {request.parameters.front()}, failure)",
         PARAMETERS),
        ("a changed parameter is a new one", "ros2/parameter_services.cpp",
         "event.new_parameters = messages(«changes.added»)", "changes.changed", PARAMETERS),
        ("a range has no step", "ros2/parameter_services.cpp",
         ".set__to_value(range->to_value)\n                                        .set__step(«range->step»)", "0u", PARAMETERS),
        ("a too long request is served", "ros2/parameter_services.cpp", "if («why.empty()») return callback(request, response);",
         "true", PARAMETERS),
        ("a goal is accepted twice", "ros2/action_server_core.hpp", "«find(id) != nullptr» || !has_room()", "false", SERVERS),
        ("a goal is executed twice", "ros2/action_server_core.hpp",
         "goal == nullptr || «goal->state != GoalState::accepted») return false;", "false", SERVERS),
        ("a server that goes answers nobody", "ros2/action_server_core.hpp",
         "‹    for (const RequestId request : asking) service->send_response(request, aborted);›", "", SERVERS),
        ("a best-effort publisher is reliable", "rclcpp/src/qos.cpp",
         "if («profile_.reliability == RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT» ||", "false", RCLCPP),
        ("equal QoS of another depth", "rclcpp/src/qos.cpp", "a.history == b.history && «a.depth == b.depth» &&", "true", RCLCPP),
        ("times of two sources are compared", "rclcpp/src/time.cpp", "if («a.get_clock_type() != b.get_clock_type()»)", "false",
         RCLCPP),
        ("a sum of times overflows", "rclcpp/src/time.cpp", "if («__builtin_add_overflow(a, b, &result)») throw",
         "__builtin_add_overflow(a, b, &result) && false", RCLCPP),
        ("a trigger ends two waits", "rclcpp/src/wait_set.cpp", "if («is_ready») member.entity->take(slot);", "false", RCLCPP),
        ("a parameter of another node is ours", "rclcpp/src/parameter_event_handler.cpp",
         "if («!node_name.empty() && event.node != node_name») return false;", "false", RCLCPP),
        ("a sum of squares from the new average", "rclcpp/src/topic_statistics.cpp",
         "sum_of_squares += «(value - before) * (value - average)»", "(value - average) * (value - average)", RCLCPP),
    ]
}
ORACLE = BOUNDS[:-1] + ("--gtest_filter=Oracle.*",)  # random systems on the executors, which differ from it then
CPU_LIMITS_S = {ORACLE: 180}  # in which each is seen
GROUP, READY, QUEUE = "callback_groups/callback_group.hpp", "executors/engine/ready_set.hpp", "executors/engine/ready_queue.hpp"
MUTATIONS |= {
    name: (path, there, instead, ORACLE)
    for name, path, there, instead in [
        ("an announcement is lost", READY, "if («record.state.make_ready(record.is_announced)») enqueue(record, arrival);",
         "arrival.sequence % 64 != 0 && record.state.make_ready(record.is_announced)"),
        ("a parked callback is forgotten", READY, "more, 1);\n  ‹queue_.unpark(record.exclusion->leave());›", "record.exclusion->leave();"),
        ("the last parked callback is forgotten", GROUP, "if («busy_ || parked_ == 0») return nullptr;", "busy_ || parked_ <= 1"),
        ("a busy group admits a second callback that waits", GROUP, "if («busy_») {", "busy_ && parked_ == 0"),
        ("a group is left too early", "executors/engine/dispatcher.cpp",
         "‹workers_.pass_on();›\n    lock().unlock();\n    execution.is_taken = record->entity->take(execution.slot);  // it may",
         "record->exclusion->leave();\nworkers_.pass_on();"),
        ("a timer is released twice", "entities/timer.cpp", "compare_exchange_weak(due, «later(due + missed * period_, period_)»)",
         "due.time_since_epoch().count() % 7 == 0 ? later(due, Nanoseconds(1)) : later(due + missed * period_, period_)"),
        ("a worker sleeps through a release", "executors/engine/workers.cpp", "TimePoint end = «std::min(limit, release)»;", "limit"),
        ("a snapshot takes what comes meanwhile", READY, "if («!queue_.is_wait_set() || queue_.is_empty()») poll();", "true"),
        ("what remains counts as new", READY,
         "if («!record.entity->front(arrival)») arrival = {next_sequence(), timers_.now()};\n  enqueue", "true"),
        ("events belong to the window that is served", QUEUE, "windows_ahead_(«readiness == Readiness::wait_set ? 0 : 1»)", "0"),
        ("a polling point opens no window", QUEUE, "if («selection_.is_open()») ++window_;", "false"),
        ("the window that is served stays the first", QUEUE, "window_ = «std::max(window_, record.window)»;", "window_"),
        ("what comes while it runs is forgotten", "executors/engine/record_state.hpp", "if («!more && (word & kDrained) != 0») {", "false"),
        ("one message is all", "executors/engine/dispatcher.cpp", "ready_.finished(record, «execution.slot.more»);", "false"),
        ("nobody hears of what is left over", "executors/engine/ready_set.cpp",
         "bool ReadySet::has_another() noexcept {\n  if («!selection().is_open()») return false;", "true"),
        ("an announcement wakes nobody", "executors/engine/dispatcher.cpp", "‹workers_.notify_of(record);›", "return;"),
        ("what becomes ready joins the snapshot at once", QUEUE,
         "«is_wait_set_» ? add_to_next_snapshot(record)", "false"),
        ("what came before is taken after", READY, "if («queue_.is_wait_set() && !inbox_.empty()») drain_inbox();  // they came before", "false"),
        ("only the first worker waits for releases", "executors/engine/workers.cpp", "if («first < first_wait_») return",
         "worker.index == 0 && first < first_wait_"),
        ("a worker relies on one that waits for later", "executors/engine/workers.cpp",
         "first_wait_ = «std::min(first_wait_, each.waits_until)»", "each.waits_until"),
        ("a period's outputs are sent at once", "executors/engine/rule_step.cpp", "worker, execution, «outputs_.get()»);", "nullptr"),
        ("a period begins when it is looked at", "executors/triggered_executor.cpp",
         "end_ = «later(end_ + missed * period_, period_)»;", "later(now, period_)"),
    ]
}
