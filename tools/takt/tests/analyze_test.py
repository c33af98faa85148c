#!/usr/bin/env python3
"""takt model and takt analyze: from a run to verdicts and exit statuses, an explanation that
adds up, a sweep, and mistakes.

usage: analyze_test.py TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, finish, proves  # noqa: E402

takt = os.path.abspath(sys.argv[1])

# What nobody checks on this machine is accepted, so that the verdicts are about the rest.
ACCEPTED = """accept:
  host_not_shared: a test
  no_page_faults: a test
  overheads_are_zero: a test
  as_measured: a test
  not_seen: a test
  nothing_else_runs: of other tests
  realtime_granted: a test
  rt_runtime_as_here: a test
"""
ROBOT = ACCEPTED + """
threads:
  control: {policy: SCHED_FIFO, priority: 80, affinity: [0]}
  rest: {policy: SCHED_FIFO, priority: 40, affinity: [0]}
executors:
  fast: {type: events, scheduler: fixed_priority, threads: [control]}
  bulk: {type: single_threaded, threads: [rest]}
container:
  name: robot
  components:
    - component: takt::Workload
      name: imu
      executor: fast
      parameters: {publishers: {topic: [imu], period_us: [5000], work_us: [500]}}
    - component: takt::Workload
      name: planner
      executor: bulk
      parameters:
        subscriptions: {topic: [imu], work_us: [1000]}
        publishers: {topic: [map], period_us: [50000], work_us: [9000]}
chains:
  - {name: sense, deadline: DEADLINE, path: [imu/imu_timer, planner/imu]}
"""


def run(*words, command="analyze"):
    done = subprocess.run([takt, command, *words], env=environment, text=True, capture_output=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


with tempfile.TemporaryDirectory() as folder:
    def write(name, text):
        path = os.path.join(folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    robot = write("robot.yaml", ROBOT.replace("DEADLINE", "20ms"))
    status, output, errors = run(robot)
    check(proves("command_line.md", "Exit 0 if there are chains, and each has a deadline and is guaranteed; else 1"), status == 0 and re.search(r"^sense +20.000 .* guaranteed ", output, re.M), status, output, errors)

    # A variable changed what runs, and not what was analysed.
    alone = run(robot)[1]
    environment["TAKT_EXECUTOR"] = "multi_threaded"
    status, output, errors = run(robot)
    del environment["TAKT_EXECUTOR"]
    check("analyses what the environment lets run", "note: TAKT_EXECUTOR=multi_threaded is in force" in errors and output != alone, output, errors)

    # It was guaranteed by what nobody had checked, and ended with 0.
    bare = write("bare.yaml", ROBOT.replace("DEADLINE", "20ms").replace(ACCEPTED, ""))
    status, output, errors = run(bare, "--suggest", "off")
    check("bounded if", status == 1 and re.search(r"^sense is bounded if$", output, re.M) and
          "  overheads_are_zero: these take no time: " in output and "accept: {overheads_are_zero: 'why it holds'}" in output,
          status, output, errors)
    check("bounded if is allowed", run(bare, "--allow-unbounded", "--suggest", "off")[0] == 0)
    document = json.loads(run(bare, "--json", "-")[1])["chains"][0]
    check("what is missing", document["verdict"] == "bounded if" and "overheads_are_zero" in document["missing"] and
          all(each["accepted"] is None for each in document["assumptions"]), document)
    measured = run(bare, "--overheads", "measure", "--json", "-")
    chain = json.loads(measured[1])["chains"][0]
    check("overheads measured here", "overheads_are_zero" not in chain["missing"] and
          any(each["id"] == "as_measured" and "measured here, n = 1000" in each["source"] for each in chain["assumptions"]),
          measured)
    status, output, errors = run(write("wrong_id.yaml", ROBOT.replace("DEADLINE", "20ms").replace("not_seen", "not_sen")))
    check("an unknown assumption", status == 2 and "did you mean 'not_seen'" in errors, status, output, errors)

    late = write("late.yaml", ROBOT.replace("DEADLINE", "3ms"))
    status, output, errors = run(late)
    check("not shown", status == 1 and " not shown " in output and "what would help" in output, status, output, errors)

    # What a simulation finds stands beside it, and can be repeated.
    stated = "machine: {cpus: [0], rt_runtime: 950ms}\n"
    late = write("late_there.yaml", stated + ROBOT.replace("DEADLINE", "3ms"))
    status, output, errors = run(late, "--simulate", "6", "--suggest", "off")
    check("a witness", status == 1 and re.search(r"^chain +deadline_ms +p99.9_ms +max_ms +simulated_ms +bound_ms", output, re.M) and
          re.search(r"^sense +3.000 .* missed ", output, re.M) and "sense takes 11.500 ms in a simulation, its deadline is 3.000 ms" in output,
          status, output, errors)
    witness = shlex.split(re.search(r"^sense is late in: takt (simulate .*)$", output, re.M)[1])
    shown = run(*witness[1:], "--json", "-", command=witness[0])
    check("shows that it is late", shown[0] == 1 and json.loads(shown[1])["runs"][0]["chains"][0]["latency_us"]["max"] == 11500, witness, shown)
    check("which is allowed in no way", run(late, "--simulate", "6", "--allow-unbounded")[0] == 1)
    document = json.loads(run(late, "--simulate", "6", "--json", "-")[1])
    check("the JSON has it", document["chains"][0]["simulated_us"] == {"max": 11500.0, "scenario": witness[-1], "witness": shlex.join(["takt", *witness])} and
          document["simulated"] == {"runs": 6, "duration_us": 10e6, "why_not": None, "notes": []}, document)
    # The simulation has the same bounds, whether the machine is known or not: its grant counts in all of these.
    for name, machine in {"here": "cpus: [0], rt_runtime: 900ms", "elsewhere": "cpus: [0, 1023], rt_runtime: 900ms", "not said": "cpus: [0]",
                          "all": "rt_runtime: 950ms"}.items():
        busy = write("busy.yaml", "machine: {" + machine + "}\n" + ROBOT.replace("DEADLINE", "3s").replace("5000", "2000000").replace("[500]", "[800000]"))
        chain = json.loads(run(busy, "--json", "-")[1])["chains"][0]
        shown = json.loads(run(busy, "--duration", "1s", "--json", "-", command="simulate")[1])
        check(f"the same bounds, with the machine {name}", chain["bound_us"] is not None and shown["bounds_us"] == {"sense": chain["bound_us"]}, chain, shown["bounds_us"])
    anywhere = write("anywhere.yaml", stated.replace("cpus: [0], ", "") + ROBOT.replace("DEADLINE", "3ms").replace(", affinity: [0]", ""))
    witness = json.loads(run(anywhere, "--simulate", "2", "--json", "-")[1])["chains"][0]["simulated_us"]["witness"]
    first = os.cpu_count() == len(os.sched_getaffinity(0))
    check("with the CPUs of this machine", (f"--cpus {os.cpu_count()} " in witness) or not first, witness)
    in_time = write("in_time.yaml", stated + ROBOT.replace("DEADLINE", "20ms").replace(ACCEPTED, ""))
    status, output, errors = run(in_time, "--simulate", "6", "--suggest", "off")
    check("none found", "sense is late in none of 6 simulated runs of 10s\n" in output, output, errors)
    several = ROBOT.replace("DEADLINE", "3ms").replace("container:\n  name: robot\n", "containers:\n- name: robot\n")
    two = write("two.yaml", stated + "topics: {/imu: {delay: {min: 100us, max: 300us}}}\n" +
                several.replace("    - component: takt::Workload\n      name: planner", "- name: more\n  components:\n"
                                "    - component: takt::Workload\n      name: planner"))
    status, output, errors = run(two, "--simulate", "6", "--suggest", "off")
    takes = re.search(r"sense takes ([0-9.]+) ms in a simulation, its deadline is 3.000 ms", output)
    witness = shlex.split((re.search(r"^sense is late in: takt (simulate .*)$", output, re.M) or ["", "simulate"])[1])
    shown = run(*witness[1:], "--json", "-", command=witness[0])
    check("a witness of two processes", status == 1 and takes and shown[0] == 1 and
          json.loads(shown[1])["runs"][0]["chains"][0]["latency_us"]["max"] == 1000 * float(takes[1]), output, errors, shown)
    spins = write("spins.yaml", stated + ROBOT.replace("DEADLINE", "20ms").replace("type: events", "type: events, spin: 10us"))
    status, output, errors = run(spins, "--simulate", "6", "--suggest", "off")
    check("threads that spin are simulated", re.search(r"^sense +20.000 +- +- +11.", output, re.M), output, errors)
    clock = write("clock.yaml", stated + ROBOT.replace("DEADLINE", "20ms").replace("{publishers: {topic: [imu]", "{use_sim_time: true, publishers: {topic: [imu]"))
    status, output, errors = run(clock, "--simulate", "6", "--suggest", "off")
    check("what cannot be simulated is named", "\nnot simulated: " in output and "follows /clock" in output, output, errors)

    plain = write("plain.yaml", ROBOT.replace("DEADLINE", "20ms").replace("policy: SCHED_FIFO, priority: 40, ", ""))
    status, output, errors = run(plain)
    check("no bound", status == 1 and "sense has no bound: bulk: thread 'rest' is SCHED_OTHER" in output, status, output, errors)

    # It counted as a deadline that is not guaranteed.
    free = write("free.yaml", ROBOT.replace("deadline: DEADLINE, ", "").replace("policy: SCHED_FIFO, priority: 40, ", ""))
    status, output, errors = run(free)
    check("no deadline, no bound", status == 1 and "sense has no bound" in output, status, output, errors)
    check("the first line says so", output.startswith("no chain has a bound: bulk: thread 'rest' is SCHED_OTHER"), output)
    for name, file, expected in [("no bound", plain, 0), ("no deadline", free, 0), ("not shown", late, 0)]:
        status, output, errors = run(file, "--allow-unbounded", "--suggest", "off")
        check(f"allowed: {name}", status == expected and "what would help" not in output, status, output, errors)

    # Both ended with 0, and said nothing.
    chainless = write("chainless.yaml", ROBOT[:ROBOT.index("chains:")])
    status, output, errors = run(chainless)
    check("no chains", status == 1 and output.startswith(f"'{chainless}' has no chains"), status, output, errors)
    check("no chains, allowed", run(chainless, "--allow-unbounded")[0] == 0)

    # Takt makes executors and threads from the chains; these have real-time priorities, too.
    planned = write("planned.yaml", re.sub(r" +executor: \w+\n", "", ROBOT.replace("DEADLINE", "20ms"))
                    .replace(ROBOT[len(ACCEPTED):ROBOT.index("container:")], "\n"))
    status, output, errors = run(planned, "--suggest", "off")
    check("planned executors", output.startswith("1 chain: 1 with a bound"), status, output, errors)

    # A file for a machine with more CPUs was refused.
    elsewhere = write("elsewhere.yaml", "machine: {cpus: [64, 65]}\n" + ROBOT.replace("DEADLINE", "20ms")
                      .replace("affinity: [0]", "affinity: [65]"))
    status, output, errors = run(elsewhere)
    check("a machine of its own", status == 0 and " guaranteed " in output and "note: CPU 64 is not here: it is another machine" in errors, status, output, errors)
    status, output, errors = run(elsewhere, "--duration", "10ms", command="run")
    check("which is not this one", status == 2 and "there is no CPU 65 here" in errors, status, output, errors)

    status, output, errors = run(robot, "--json", "-")
    chain = json.loads(output)["chains"][0]
    segments = sum(segment["bound_us"] + segment["wait_us"] for segment in chain["segments"])
    check("the segments add up", abs(segments - chain["bound_us"]) < 0.01, chain)

    status, output, errors = run(robot, "--explain", "sense")
    parts = output.split("\n\n")[1:]
    for part in parts:
        bound = float(re.match(r"\d+\. ([0-9.]+) ms", part)[1])
        terms = [float(term) for term in re.findall(r"^ +(-?[0-9.]+) ms  ", part, re.M)]
        check("the terms add up", terms and abs(sum(terms) - bound) < 0.002, part)
    check("two executors", len(parts) == 2, output)

    status, output, errors = run(robot, "--sweep", "threads.rest.priority=10..90")
    check("a sweep", status == 0 and len(re.findall(r"^ +\d+ +\d+\.\d{3}$", output, re.M)) == 10, output, errors)

    trace, model = (os.path.join(folder, name) for name in ("robot.json", "robot.model.yaml"))
    status, output, errors = run(robot, "--duration", "300ms", "--trace", trace, command="run")
    check("a run with a trace", status == 0, output, errors)
    status, output, errors = run(trace, "-o", model, "--json", "-", command="model")
    callbacks = {callback["callback"]: callback for callback in json.loads(output)["callbacks"]}
    check("the callbacks of the system", sorted(callbacks) == ["/imu/imu_timer", "/planner/imu", "/planner/map_timer"],
          output, errors)
    check("what one has caused", callbacks["/imu/imu_timer"]["causes"] == {"/planner/imu": 1}, output)
    check("in CPU time", callbacks["/planner/map_timer"]["execution_us"]["min"] >= 9000, output)
    status, output, errors = run(trace, command="model")
    check("a table of the model", status == 0 and re.search(r"^/planner/map_timer +\d+ ", output, re.M), output, errors)
    status, output, errors = run(robot, "--model", model, "--json", "-")
    document = json.loads(output)
    check("an analysis rests on it", {callback["rests_on"] for callback in document["callbacks"]} == {"measured"}, output)
    observed = document["chains"][0]["observed_us"]
    check("and shows what was observed", observed["instances"] > 10 and observed["p50"] <= observed["max"], output)
    check("and what it took for granted", any("no arrivals are closer" in text for text in document["assumptions"]), output)
    # Both stood beside "guaranteed".
    # Without overheads, it is these that a longer run refutes.
    slow = write("slow.model.yaml", "callbacks: {}\nchains: {sense: {instances: 1, max: 19ms}}\n")
    status, output, errors = run(robot, "--model", slow)
    check("overheads are refuted", status == 1 and " bounded if " in output and
          "sense took 19.000 ms in the measured run, its bound is " in output, status, output, errors)
    robot = write("robot.yaml", "machine: {overheads: {dispatch: 1ns, wake: 1ns, switch: 1ns, publish: 1ns}}\n" +
                  ROBOT.replace("DEADLINE", "20ms").replace(ACCEPTED, ACCEPTED + "  as_declared: a test\n"))
    bound = json.loads(run(robot, "--json", "-")[1])["chains"][0]["bound_us"]
    missed_or_refuted = proves("command_line.md", "exit 0 unless a chain is `missed` or `model refuted`")
    for longest, verdict, words in [
            ("20.1ms", "missed", "took 20.100 ms in the measured run, its deadline is 20.000 ms"),
            (f"{bound + 1}us", "model refuted", f"took {(bound + 1) / 1000:.3f} ms in the measured run, its bound is ")]:
        slow = write("slow.model.yaml", f"callbacks: {{}}\nchains: {{sense: {{instances: 1, max: {longest}}}}}\n")
        status, output, errors = run(robot, "--model", slow)
        check(verdict, status == 1 and f" {verdict} " in output and words in output, status, output, errors)
        check(f"{missed_or_refuted} ({verdict})", run(robot, "--model", slow, "--allow-unbounded")[0] == 1)
        status, output, errors = run(robot, "--model", slow, "--executor", "events")
        check("observed with other executors", words not in output and "are not shown" in errors, status, output, errors)
    # Latencies of other executors stood beside the bounds of these.
    edited = write("edited.yaml", ROBOT.replace("DEADLINE", "20ms").replace("type: single_threaded", "type: events"))
    status, output, errors = run(edited, "--model", model)
    check("a model of other executors", "ran on single_threaded with " in errors and "runs on events with " in errors and
          json.loads(run(edited, "--model", model, "--json", "-")[1])["chains"][0]["observed_us"] is None, errors)
    check("a model of another file", "the model was measured with '" + robot in errors, errors)
    check("its own is not marked", run(robot, "--model", model)[2] == "")
    with open(model, encoding="utf-8") as file:
        lines = file.read()

    def missing(*words):
        return json.loads(run(*words, "--json", "-")[1])["chains"][0]["missing"]
    check("nor is it from elsewhere", "model_from_elsewhere" not in missing(robot, "--model", model))
    elsewhere = write("elsewhere.model.yaml", re.sub("^machine: .*$", "machine: 16 x i9, Linux 6.8", lines, flags=re.M))
    check("a model of another machine", "model_from_elsewhere" in missing(robot, "--model", elsewhere))
    for key, what in [("duration", "how long the run was"), ("executors", "on which executors"), ("components", "of which builds")]:
        silent = write("silent.model.yaml", re.sub(rf"^{key}:.*\n(?:[ ].*\n)*", "", lines, flags=re.M))
        texts = " ".join(json.loads(run(robot, "--model", silent, "--json", "-")[1])["assumptions"])
        check(f"a model without '{key}'", f"the model does not say {what}" in texts, texts)
    with open(robot, encoding="utf-8") as file:
        changed = file.read().replace("work_us: [500]", "work_us: [501]")
    changed = write("changed.yaml", changed)
    check("a model of other components", "model_from_elsewhere" in missing(changed, "--model", model))
    # The run says what it was of: the file may be another one when its trace is read.
    with open(robot, encoding="utf-8") as file:
        kept = file.read()
    write("robot.yaml", kept + "cpu_dma_latency_us: 5\n")
    run(trace, "-o", os.path.join(folder, "late.model.yaml"), command="model")
    texts = " ".join(json.loads(run(robot, "--model", os.path.join(folder, "late.model.yaml"), "--json", "-")[1])["assumptions"])
    other = os.path.join(folder, "other.json")
    run(robot, "--duration", "100ms", "--trace", other, command="run")
    status, output, errors = run(trace, other, command="model")
    check("traces with other settings", status == 2 and f"{other}: this trace is of other settings than '{trace}'" in errors,
          status, errors)
    check("a model of other settings", "though `cpu_dma_latency_us: 5` was not set in the measured run" in texts, texts)
    write("robot.yaml", kept)
    status, output, errors = run(robot, command="model")
    check("a file that is no trace", status == 2 and "this is not a trace of this version of Takt" in errors, output, errors)
    status, output, errors = run(trace, "-o", os.path.join(folder, "none", "x.yaml"), command="model")
    check("a model that cannot be written", status == 2 and "choose a writable file" in errors, output, errors)
    with open(trace, encoding="utf-8") as file:
        seen = file.read()
    begun = int(re.search(r'"begin_ns":(\d+)', seen)[1])
    later = seen.replace(f'"begin_ns":{begun}', f'"begin_ns":{begun + 1}')
    for name, changed, text in [
            ("the same run twice", seen, f"this trace is of the same run as '{trace}'"),
            ("another machine", re.sub('"machine":"[^,]*,', '"machine":"64 x AMD,', later), "this trace is of '64 x AMD, Linux"),
            ("another executor", later.replace('"type":"events"', '"type":"single_threaded"'), "single_threaded with fixed_priority here, and on")]:
        status, output, errors = run(trace, write("again.json", changed), command="model")
        check(f"traces of {name}", status == 2 and text in errors, status, output, errors)
    status, output, errors = run(trace, write("again.json", later), command="model")
    check("two runs", status == 0 and "/imu/imu_timer" in output, status, output, errors)
    with open(trace, encoding="utf-8") as file:
        switched = write("switched.json", file.read().replace('"modes":[]', '"modes":["calm"]'))
    status, output, errors = run(switched, command="model")
    check("a trace of another mode", status == 2 and "mode 'calm' was in force for a part of this run" in errors, output, errors)
    simulated = os.path.join(folder, "simulated.json")
    run(robot, "--duration", "100ms", "--trace", simulated, command="simulate")
    status, output, errors = run(simulated, command="model")
    check("a trace of a simulation", status == 2 and "of a simulation, which measures nothing" in errors, output, errors)
    run(late, "--duration", "100ms", "--trace", os.path.join(folder, "late.json"), command="run")
    status, output, errors = run(trace, os.path.join(folder, "late.json"), command="model")
    check("traces of two systems", status == 2 and "give traces of one system" in errors, output, errors)

    for name, words, text in [
            ("a wrong key", [robot, "--sweep", "threads.rset.priority=1..9"], "there is no 'rset'"),
            ("a wrong range", [robot, "--sweep", "threads"], "KEY=A..B"),
            ("a wrong chain", [robot, "--explain", "sens"], "no chain is called 'sens'"),
            ("no such file", [os.path.join(folder, "none.yaml")], "none.yaml"),
            ("a wrong model", [robot, "--model", robot], "robot.yaml:")]:
        status, output, errors = run(*words)
        check(name, status == 2 and text in errors, status, output, errors)
    for text, part in [("execution: 0ms", "takes some time"), ("execution: {min: 2ms, max: 1ms}", "longer than its longest"),
                       ("arrival: {}", "a period or distances"), ("outputs: later", "'outputs' cannot be 'later'")]:
        wrong = write("wrong.yaml", ROBOT.replace("DEADLINE", "20ms").replace(
            "      name: imu\n", f"      name: imu\n      callbacks: {{imu_timer: {{{text}}}}}\n"))
        status, output, errors = run(wrong)
        check(text, status == 2 and part in errors and "wrong.yaml:" in errors, status, output, errors)

finish()
