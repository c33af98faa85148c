#!/usr/bin/python3
"""A program written for rclcpp is run, compared and analysed as a file is: run_test.py TAKT PROGRAM SCHEMA

SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cmake"))
from checks import check, environment, finish, proves  # noqa: E402

takt, program, schema = map(os.path.abspath, sys.argv[1:])
FILE = """
realtime: off
threads: {urgent: {nice: 1}}
executors: {fast: {type: events, threads: [urgent]}}
nodes:
  /talker: {executor: fast}
  /listener: {executor: fast}
chains: [{name: talks, deadline: 1s, path: [talker/timer_1ms, listener//chatter]}]
"""


def run(*words, status=0, **variables):
    done = subprocess.run([takt, *words], env=environment | variables, text=True, capture_output=True, timeout=60)
    check(f"takt {' '.join(words)[:70]}: status {status}", done.returncode == status, done.returncode,
          done.stdout, done.stderr)
    return done


def rows_of(document):
    """(node, callback) → (executor, number of calls)"""
    return {(row["node"], row["callback"]): (row["executor"], row["received"])
            for row in document["runs"][0]["callbacks"]}


def keeps_schema(document):
    try:
        import jsonschema
    except ImportError:
        return True  # results_test.py says which package brings it
    return not list(jsonschema.Draft202012Validator(json.loads(pathlib.Path(schema).read_text())).iter_errors(document))


def is_served(document, executor):
    rows = rows_of(document)
    return all(rows.get(key, ("", 0))[0] == executor and rows[key][1] >= 10
               for key in (("/talker", "timer_1ms"), ("/listener", "/chatter")))


def is_run(folder):
    text = run("run", "--duration", "400ms", "--", program).stdout
    check("what a program says is seen, and its callbacks", "it talks" in text and "/chatter" in text, text)

    done = run("run", "--duration", "400ms", "--json", "-", "--", program)
    document = json.loads(done.stdout)
    check("the document is the results'", keeps_schema(document), done.stdout)
    check("its executor has its type's name", is_served(document, "single_threaded"), done.stdout)
    check("the run has the program's name", document["runs"][0]["file"] == f"-- {program}", document["runs"][0]["file"])
    check("and no parameter services", "parameters" not in str(rows_of(document)), rows_of(document))
    check("what it says goes to stderr", "it talks" in done.stderr, done.stderr)

    document = json.loads(run("run", "--executor", "events", "--duration", "400ms", "--json", "-", "--", program).stdout)
    check("another executor is in force", is_served(document, "events"), document)

    counts = [row["allocations"] for row in document["runs"][0]["callbacks"]]
    check("nobody has counted allocations", set(counts) == {None}, counts)
    document = json.loads(run("run", "--allocations", "--duration", "400ms", "--json", "-", "--", program).stdout)
    of = {row["callback"]: (row["received"], row["allocations"]) for row in document["runs"][0]["callbacks"]}
    check("some are counted at first, and none later", all(0 <= of[name][1] < 20 < of[name][0] for name in ("timer_1ms", "/chatter"))
          and of["timer_1ms"][1] > 0, of)
    refused = run("run", "--allocations", "robot.yaml", status=2)
    check(proves("command_line.md", "Without one it is an error, as what containers allocate is always counted"),
          "leave it out" in refused.stderr, refused.stderr)

    file = folder / "robot.yaml"
    file.write_text(FILE)
    document = json.loads(run("run", str(file), "--duration", "400ms", "--json", "-", "--", program).stdout)
    check("a file serves it", is_served(document, "fast"), document)
    check("and measures its chains", document["runs"][0]["chains"][0]["instances"] >= 10, document["runs"][0]["chains"])

    results = folder / "results.json"
    done = subprocess.run([program, "calls", "50", "0"], env=environment | {"TAKT_RESULTS": str(results)}, timeout=60)
    document = json.loads(results.read_text())
    check("a program alone writes them, too", done.returncode == 0 and keeps_schema(document)
          and is_served(document, "single_threaded"), document)


def is_watched(folder):
    file = folder / "watched.yaml"
    file.write_text(FILE)
    talker = subprocess.Popen([program], env=environment | {"TAKT_CONFIG": str(file)}, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    talker.stdout.readline()
    for _ in range(10):  # until it is discovered
        done = subprocess.run([takt, "top", "--json", "--count", "2", "--interval", "300ms"], env=environment, text=True,
                              capture_output=True, timeout=60)
        if done.returncode == 0:
            break
    changed = run("callback", "set", "_rclcpp_talk", "talker/timer_1ms", "deadline=20ms")
    nodes = subprocess.run([takt, "node", "list"], env=environment, text=True, capture_output=True, timeout=60).stdout
    talker.terminate()
    talker.communicate(timeout=60)
    (container,) = json.loads(done.stdout.splitlines()[-1])["containers"] if done.returncode == 0 else [{}]
    rows = {(row["node"], row["callback"]): row["rate_hz"] for row in container.get("callbacks", [])}
    check("takt top shows a program with a file", rows.get(("/talker", "timer_1ms"), 0) > 10, done.stdout, done.stderr)
    check("and its deadlines can be changed", changed.returncode == 0, changed.stdout)
    check("no node is added to its graph", [line.split()[0] for line in nodes.splitlines() if line.startswith("/")] == ["/listener", "/talker"], nodes)


def is_seen(folder):
    talker = subprocess.Popen([program], env=environment, text=True, stdout=subprocess.PIPE)
    talker.stdout.readline()
    done = subprocess.run([program, "looks"], env=environment, text=True, capture_output=True, timeout=60)
    talker.terminate()
    talker.communicate(timeout=60)
    check("who looks once sees the nodes of others", "sees /talker\n" in done.stdout and "sees /listener\n" in done.stdout,
          done.stdout, done.stderr)
    # RIHS01_df66…, as ROS 2 Jazzy announces std_msgs/msg/String
    check("whose a publisher is, and the hash of its type", f"of talker, hash {0xdf}\n" in done.stdout, done.stdout)
    check("the lines of /rosout last as long as in ROS 2", "lines last 10 s\n" in done.stdout, done.stdout)


def is_measured(folder):
    trace, model = folder / "trace.json", folder / "robot.model.yaml"
    run("run", "--duration", "400ms", "--trace", str(trace), "--", program)
    run("model", str(trace), "-o", str(model))
    check("a model has its callbacks", "listener" in model.read_text(), model.read_text())

    done = run("compare", "--executors", "events,single_threaded,file", "--duration", "1s", "--repeat", "2", "--json",
               str(folder / "compared.json"), "--", program)
    check("a comparison has its name and a row each", f"-- {program} (" in done.stdout
          and all(f"\n{name} " in done.stdout for name in ("events", "single_threaded", "file")), done.stdout)
    check("and says nothing else", "it talks" not in done.stdout + done.stderr, done.stdout, done.stderr)
    document = json.loads((folder / "compared.json").read_text())
    check("six runs", len(document["runs"]) == 6 and keeps_schema(document), document)

    file = folder / "half.yaml"
    file.write_text(FILE.replace("  /listener: {executor: fast}\n", "").replace(", listener//chatter", "").replace(
        "realtime: off", "realtime: require").replace("{nice: 1}", "{policy: SCHED_FIFO, priority: 50, affinity: [0]}"))
    done = run("analyze", str(file), "--model", str(model), "--overheads", "measure", "--json", "-", "--allow-unbounded", "--", program)
    chain = json.loads(done.stdout)["chains"][0]
    check("nodes that the file leaves to the program are in its model, too", chain["bound_us"], chain, done.stderr)
    model.write_text(model.read_text().replace("/talker/", "/speaker/"))
    done = run("analyze", str(file), "--model", str(model), "--", program, status=2)
    check("but a model of another program is refused", "has no node of that name; give the model of this system" in done.stderr, done.stderr)


def is_analysed(folder):
    file = folder / "robot.yaml"
    file.write_text(FILE.replace("  /talker: {executor: fast}", """
  /talker:
    executor: fast
    callbacks: {timer_1ms: {execution: 10us}}""").replace("  /listener: {executor: fast}", """
  /listener:
    executor: fast
    callbacks: {/chatter: {execution: 10us}}""").replace("realtime: off", "realtime: require").replace(
        "{nice: 1}", "{policy: SCHED_FIFO, priority: 50, affinity: [0]}"))
    done = run("analyze", str(file), "--json", "-", "--allow-unbounded", "--", program)
    chain = json.loads(done.stdout)["chains"][0]
    check("its chain has a bound", chain["name"] == "talks" and chain["bound_us"], chain, done.stderr)
    check("what is not counted is an assumption", "asks the parameter services of the node of '/talker/timer_1ms'"
          in json.dumps(chain["assumptions"]), chain)
    check("and no other note is made", done.stderr.count("note: ") == 1 and "warn" not in done.stderr, done.stderr)
    for done in (run("analyze", str(file), "--", program, "own", status=2),
                 run("run", str(file), "--duration", "400ms", "--", program, "own", status=1)):
        check("a chain does not go through an executor of the program",
              "chain 'talks': '/chatter' has an executor already" in done.stderr and "SIGABRT" not in done.stderr,
              done.stderr)
    alone = file.read_text().replace("""  /talker:
    executor: fast
    callbacks: {timer_1ms: {execution: 10us}}
""", "").replace("talker/timer_1ms, ", "")
    (folder / "alone.yaml").write_text(alone)
    done = run("analyze", str(folder / "alone.yaml"), "--json", "-", "--", program, status=1)
    chain = json.loads(done.stdout)["chains"][0]
    check("a node that the file does not name sends", chain["verdict"] == "model refuted" and
          "'/talker', a node of the program that is not in the file, may send to" in json.dumps(chain), chain, done.stderr)
    file.write_text(file.read_text().replace("timer_1ms: {", "timer_2ms: {"))
    done = run("analyze", str(file), "--", program, status=2)
    check("a name that it does not have is an error", "did you mean 'timer_1ms'" in done.stderr, done.stderr)
    done = run("analyze", str(file), "--", "true", status=2)
    check("as is a program that is none of ours", "has not spun" in done.stderr, done.stderr)


SIMULATED = FILE.replace("  /talker: {executor: fast}", """
  /talker:
    executor: fast
    callbacks: {timer_1ms: {execution: 100us}}""").replace("  /listener: {executor: fast}", """
  /listener:
    executor: fast
    callbacks: {/chatter: {execution: {min: 200us, max: 300us}}}""").replace("realtime: off", "machine: {cpus: 1}").replace(
        "{nice: 1}", "{policy: SCHED_FIFO, priority: 50, affinity: [0]}")


def is_simulated(folder):
    file = folder / "robot.yaml"
    file.write_text(SIMULATED)

    def simulated(*words, status=0):
        return run("simulate", str(file), "--duration", "1s", *words, status=status)

    done = simulated("--json", "-", "--", program)
    document = json.loads(done.stdout)
    check("a simulated program calls each callback when it is due", rows_of(document) == {
        ("/talker", "timer_1ms"): ("fast", 1000), ("/listener", "/chatter"): ("fast", 1000)}, rows_of(document))
    latency = document["runs"][0]["chains"][0]["latency_us"]
    check("in virtual time", latency["max"] == 400 and document["bounds_us"]["talks"] >= 400, latency, document["bounds_us"])
    check("its code has run", "it talks" in done.stderr, done.stderr)
    again = simulated("--json", "-", "--", program)
    check("the same each time", again.stdout == done.stdout)

    done = simulated("--runs", "3", "--search", "--set", "threads.urgent.priority=40", "--scale", "/listener=1.1",
                     "--speed", "0.5", "--", program)
    check("other speeds and times are", " 860 " in done.stdout and "--replay 1,worst,all=0s" in done.stdout, done.stdout)
    document = json.loads(simulated("--faults", "lost", "--runs", "2", "--json", "-", "--", program).stdout)
    check("and faults", all("lost=/listener/chatter@" in run["scenario"] for run in document["runs"]), document["runs"])
    done = simulated("--replay", "2,drawn,lost=/listener/chatter@3ms", "--json", "-", "--", program)
    check("and scenarios", json.loads(done.stdout)["runs"][0]["callbacks"][1]["dropped"] == 1, done.stdout)
    traces = [folder / "a.trace", folder / "b.trace"]
    for trace in traces:
        simulated("--trace", str(trace), "--", program)
    events = json.loads(traces[0].read_text())["traceEvents"]
    executions = [(event["ts"], event["dur"]) for event in events if event["ph"] == "X" and event["cat"] == "subscription"]
    switches = {event["name"] for event in events if event["ph"] == "X" and event["cat"] == "sched"}
    check("its timeline has each execution in virtual time, and its CPU",
          len(executions) == 1000 and {round(length) for _, length in executions} == {300} and switches, executions[:3], switches)
    check("and is the same each time", traces[0].read_bytes() == traces[1].read_bytes())


def refuses_what_is_not_simulated(folder):
    file = folder / "robot.yaml"
    file.write_text(SIMULATED)

    def refused(text, *words, status=1):
        errors = run("simulate", str(file), *words, status=status).stderr
        check(proves("command_line.md", "What is not under that clock ends the run, with exit status 1") + f": {text}",
              text in errors and errors.count("error: ") <= 2, errors)

    for deed, text in (("threads", "calls pthread_create() from "), ("sleeps", "calls nanosleep() from "),
                       ("clocks", "calls clock_gettime() from ")):
        refused(f"cannot be simulated: it {text}", "--", program, deed)
        refused("in the callback '/talker/timer_1ms'", "--", program, deed)
    refused("it sleeps by a Clock or a Rate", "--", program, "naps")
    refused("it spins without spin(), as by spin_some()", "--", program, "steps")
    refused("it never calls spin()", "--", program, "leaves")
    refused("it shuts down before the end", "--", program, "calls", "5", "0")
    refused("has written no results", "--", "true")
    refused("--as is for containers", "--as", "ros2_default", "--", program, status=2)
    how = {"scenario": "1,worst,all=0s", "duration_ns": 1, "cpus": [0], "speed": 1, "scales": {}, "settings": {}, "mode": "",
           "model": "", "faults": ""}
    done = subprocess.run([program], env=environment | {"TAKT_SIMULATE": json.dumps(how), "TAKT_CONFIG": str(file)},
                          text=True, capture_output=True, timeout=60)
    check("nor is one simulated whose calls nobody sees", done.returncode == 2 and
          "it runs without libtakt_simulated.so" in done.stderr, done.returncode, done.stderr)
    file.write_text(SIMULATED.replace("  /listener:", "  /nobody:").replace("listener//", "nobody//"))
    refused("it spins '/listener', which its file does not name", "--", program)
    file.write_text(SIMULATED.replace("{execution: {min: 200us, max: 300us}}", "{}"))
    refused("cannot simulate '/listener/chatter': its execution time is not known", "--", program)


def ends(folder):
    done = run("run", "--duration", "400ms", "--", "sh", "-c", f"sleep 30 & cd / && exec {program}")
    check("what a program leaves behind ends, too", "/chatter" in done.stdout, done.stdout)
    done = run("run", "--duration", "30s", "--", program, "calls", "50", "0")
    check("a program may end by itself", "/chatter" in done.stdout, done.stdout)
    done = run("run", "--duration", "30s", "--", program, "calls", "50", "3", status=1)
    check(proves("command_line.md", "The exit status is 1 if that of the program is not 0"), done.returncode == 1 and "/chatter" in done.stdout and "ended with status 3" in done.stderr, done.stderr)
    done = run("compare", "--executors", "events", "--duration", "30s", "--", program, "calls", "50", "3", status=1)
    check("in a comparison, too", "ended with status 3" in done.stderr, done.stderr)

    for count, hangs in ((1, []), (2, ["hangs"])):
        started = subprocess.Popen([takt, "run", "--", program, *hangs], env=environment, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        said = started.stdout.readline()
        for number in (signal.SIGINT, signal.SIGTERM)[:count]:
            started.send_signal(number)
        text, errors = started.communicate(timeout=15)
        if hangs:
            check("a second signal kills it", started.returncode == 1 and "was killed" in errors, errors)
        else:
            check("a signal ends it in order", said == "it talks\n" and started.returncode == 0 and "/chatter" in text,
                  started.returncode, text, errors)


def is_refused(folder):
    def refused(text, *words, status=2, **variables):
        errors = run(*words, status=status, **variables).stderr
        check(f"it says {text}", text in errors and errors.count("\n") <= 3, errors)

    refused("nothing to run", "run")
    refused("nothing to compare", "compare", "--executors", "events")
    refused("'./none' cannot be started: No such file", "run", "--", "./none")
    refused("has written no results", "run", "--", "true", status=1)
    refused("has written no results", "run", "--", "sh", "-c", "echo hi > $TAKT_RESULTS", status=1)
    refused("/none/robot.yaml", "analyze", "/none/robot.yaml", "--", program)
    refused("for containers, not for a program", "run", "--composition", "single", "--", program)
    refused("for containers, not for a program", "compare", "--compositions", "all", "--", program)
    refused("did you mean 'events'", "run", "--executor", "evens", "--", program)
    refused("/none/robot.yaml", "run", "/none/robot.yaml", "--", program)
    refused("a program is simulated with a FILE", "simulate", "--", program)
    refused("one word too many", "doctor", "--", program)

    def program_refuses(text, **variables):
        done = subprocess.run([program, "calls", "5", "0"], env=environment | variables, text=True, capture_output=True,
                              timeout=60)
        check(f"the program says {text}", done.returncode != 0 and text in done.stderr, done.returncode, done.stderr)

    program_refuses("TAKT_RESULTS=/none/out.json: the file cannot be written: No such file", TAKT_RESULTS="/none/out.json")
    program_refuses("TAKT_TRACE=-1: no number of executions", TAKT_RESULTS=str(folder / "out.json"), TAKT_TRACE="-1")


with tempfile.TemporaryDirectory() as place:
    for part in (is_run, is_watched, is_seen, is_measured, is_analysed, is_simulated, refuses_what_is_not_simulated, ends, is_refused):
        part(pathlib.Path(place))
finish()
