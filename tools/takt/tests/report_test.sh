#!/usr/bin/env bash
# Draws a report and opens it in a real browser: report_test.sh TAKT
# SPDX-License-Identifier: Apache-2.0
set -euo pipefail
takt=$1
browser=$(command -v chromium || command -v chromium-browser || true)
if [ -z "$browser" ] || ! /usr/bin/python3 -c 'import matplotlib' 2>/dev/null; then
  echo "skipped: a report (apt-get install chromium python3-matplotlib)"
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0
expect() {  # expect WHAT COMMAND...
  local what=$1
  shift
  if "$@"; then echo "holds  $what"; else echo "FAILED $what"; failed=1; fi
}
count() { grep -o -- "$1" "$work/dom.html" | wc -l; }

"$takt" bench executors --duration 500ms --repeat 1 --report "$work/report" >/dev/null
"$browser" --headless --no-sandbox --disable-gpu --user-data-dir="$work/profile" \
  --enable-logging=stderr --dump-dom "file://$work/report/report.html" \
  >"$work/dom.html" 2>"$work/log"
figures=$(count '<figure')
expect "there are figures ($figures)" test "$figures" -ge 4
expect "the page says when, how and where it was measured" \
  test "$(count '<dt>date</dt><dd>20\|<dt>command</dt><dd>.*takt bench executors\|<dt>machine</dt><dd>[0-9]')" -ge 3
expect "its title tells it from others" grep -q '<title>takt bench executors</title>' "$work/dom.html"
expect "no number has an exponent" test "$(count '[0-9]e[+-][0-9]')" -eq 0
expect "each tells its number of samples" test "$(count ' n = [0-9]')" -ge "$figures"
expect "axes carry units" test "$(count 'latency (µs)')" -ge 3
expect "a legend names each executor" test "$(count 'static_single_threaded')" -ge 3
expect "the paper's curves are there" test "$(count 'paper (Raspberry Pi 4B)')" -ge 3
expect "nothing is fetched from elsewhere" test -z "$(grep -oE '(src|href)="https?:[^"]*"' "$work/dom.html" || true)"
expect "the console is silent" test -z "$(grep CONSOLE "$work/log" || true)"
"$browser" --headless --no-sandbox --disable-gpu --user-data-dir="$work/profile" \
  --window-size=1500,2400 --screenshot="${SCREENSHOT:-$work/report.png}" \
  "file://$work/report/report.html" 2>/dev/null
expect "it can be drawn" test -s "${SCREENSHOT:-$work/report.png}"

cat >"$work/robot.yaml" <<'YAML'
threads: {control: {policy: SCHED_FIFO, priority: 80, affinity: [0]}}
executors: {default: {type: events, threads: [control]}}
chains: [{name: sense, deadline: 20ms, path: [imu/imu_timer, planner/imu]}]
container:
  name: robot
  components:
    - {component: takt::Workload, name: imu, parameters: {publishers: {topic: [imu], period_us: [5000]}}}
    - {component: takt::Workload, name: planner, parameters: {subscriptions: {topic: [imu], work_us: [1000]}}}
YAML
"$takt" run "$work/robot.yaml" --duration 500ms --trace "$work/trace.json" >/dev/null
"$takt" model "$work/trace.json" -o "$work/robot.model.yaml" >/dev/null
"$takt" analyze "$work/robot.yaml" --model "$work/robot.model.yaml" --simulate 4 --report "$work/bounds.html" >/dev/null || true
"$browser" --headless --no-sandbox --disable-gpu --user-data-dir="$work/profile" --dump-dom \
  "file://$work/bounds.html" >"$work/dom.html" 2>/dev/null
if command -v dot >/dev/null; then  # the nodes of the analysis are not part of the graph
  expect "the graph of an analysis has one edge" test "$(count 'class="edge"')" -eq 1
fi
for text in 'bound: never later' 'observed, p99.9' 'deadline' '>sense<' 'Assumption 1' 'sense, the instance that took longest of all simulated ones' \
  'hatched where a callback waits' '>CPU 0<' '>/planner/imu<'; do
  expect "the page of bounds has: $text" grep -q "$text" "$work/dom.html"
done

"$takt" latency -D 300ms --report "$work/latency.html" >/dev/null
"$browser" --headless --no-sandbox --disable-gpu --user-data-dir="$work/profile" --dump-dom \
  "file://$work/latency.html" >"$work/dom.html" 2>/dev/null
for text in 'time since the beginning (s)' 'cycles per 1 µs' '>clock_nanosleep'; do
  expect "the page of wake-up latencies has: $text" grep -q "$text" "$work/dom.html"
done
status=0
"$takt" latency -D 300ms --report "$work/latency.pdf" >/dev/null 2>"$work/said" || status=$?
expect "a report is an HTML page" test "$status" -eq 2 -a ! -e "$work/latency.pdf"
expect "which one sentence says" grep -q '^takt: .*end it with .html$' "$work/said"

"$takt" compare "$work/robot.yaml" --executors single_threaded,events --duration 100ms --repeat 6 \
  --report "$work/compared.html" >/dev/null
"$browser" --headless --no-sandbox --disable-gpu --user-data-dir="$work/profile" --dump-dom \
  "file://$work/compared.html" >"$work/dom.html" 2>/dev/null
for text in '<title>takt compare robot.yaml</title>' 'Chain sense:' 'Callbacks under events' '>imu_timer<' 'wakeups/s' \
  'graph</h2>' 'samples that were not later' 'time since the beginning (s)' '95 % interval' 'verdict' 'sense p99'; do
  expect "the page of a comparison has: $text" grep -q "$text" "$work/dom.html"
done
cat >"$work/two.yaml" <<'YAML'
containers:
  - {name: front, components: [{component: takt::Workload, name: imu, parameters: {publishers: {topic: [imu], period_us: [5000]}}}]}
  - {name: back, components: [{component: takt::Workload, name: planner, parameters: {subscriptions: {topic: [imu]}}}]}
YAML
"$takt" compare "$work/two.yaml" --executors events --duration 1s --report "$work/two.html" >"$work/table"
# Its numbers and columns are those of the terminal, also where a count is not known between processes.
cat >"$work/same.py" <<'PY'
import re, sys
table, page = (open(name, encoding="utf-8").read() for name in sys.argv[1:])
rows = [re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row) for row in re.findall(r"<tr>.*?</tr>", page, re.S)]
lines = [line.split() for line in table.splitlines()]
mine = next(row for row in rows if row and row[0] == "events")
theirs = next(line for line in lines if line and line[0] == "events")
header = next(line for line in lines if line and line[0] == "executor")
titles = [re.sub(r" \(.*", "", name).replace(" ", "_") for name in next(row for row in rows if row and row[0] == "executor")]
ours, said = dict(zip(titles, mine)), dict(zip(header, theirs))
names = {"cpu_%": "CPU", "pss_MB": "PSS"}
# The page has no percentile that so few samples do not carry.
wanted = [name for name in header if not ("p99" in name and ours[name] == "-")]
wrong = [name for name in wanted if name != "executor" and
         (said[name] != ours[names.get(name, name)] if "-" in (said[name], ours[names.get(name, name)]) else
          abs(float(said[name]) - float(ours[names.get(name, name)])) > 0.02 * abs(float(said[name])))]
sys.exit(f"{wrong}: {said} {ours}" if wrong else 0)
PY
expect "a page has the numbers of the terminal" /usr/bin/python3 "$work/same.py" "$work/table" "$work/two.html"
if command -v dot >/dev/null; then
  expect "the graph is part of it" grep -q 'process robot' "$work/dom.html"
else
  expect "without graphviz it says what is missing" grep -q 'apt-get install graphviz' "$work/dom.html"
fi

"$takt" latency -D 300ms -i 1000 -q --report "$work/latency.html" >/dev/null
"$browser" --headless --no-sandbox --disable-gpu --user-data-dir="$work/profile" --dump-dom \
  "file://$work/latency.html" >"$work/dom.html" 2>/dev/null
for text in '<title>takt latency</title>' 'cycles per 1 µs' 'percentile (%)' 'clock_nanosleep'; do
  expect "the page of takt latency has: $text" grep -q "$text" "$work/dom.html"
done
exit $failed
