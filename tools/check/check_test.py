#!/usr/bin/env python3
"""Tests of check.py: each rule finds what it is for in a bad tree, and nothing in a good one.

usage: check_test.py
SPDX-License-Identifier: Apache-2.0
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../cmake"))
from checks import check, eventually, finish, skip  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
SPDX = "// SPDX-License-Identifier: Apache-2.0\n"
EXCEPTIONS = "tools/check/exceptions.txt"


def run(files, *options, exceptions=None):
    """Checks a tree of these files; returns the status, what it says, and its exceptions then."""
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        if exceptions is not None:
            files = {**files, EXCEPTIONS: exceptions}
        for path, text in files.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text, encoding="utf-8")
        shutil.copy(HERE.parents[1] / ".clang-format", root)
        subprocess.run(["git", "init", "-q"], cwd=root, check=True)
        done = subprocess.run([HERE / "check.py", "--root", root, *options], text=True, check=False,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        listed = root / EXCEPTIONS
        return done.returncode, done.stdout, listed.read_text() if listed.exists() else ""


def refused(what, files, *findings, exceptions=None):
    """The tree is refused with exactly these lines."""
    status, said, _ = run(files, exceptions=exceptions)
    lines = [line for line in said.splitlines() if line.split(":")[0] in files]
    check(what, status == 1 and lines == list(findings), status, said, findings)


def accepted(what, files, exceptions=None):
    status, said, _ = run(files, exceptions=exceptions)
    check(what, status == 0 and "FAILED" not in said, status, said)


def function(name, lines):
    return f"void {name}() {{\n" + "  work();\n" * (lines - 2) + "}\n"


GOOD = {
    "base/good.hpp": SPDX + """
namespace TAKT_PUBLIC takt {

/// A list of `news { of } {`.
///
/// Thread safety: none.
/// Real-time: allocates.
template <class T, Handler<T> F>
requires std::integral<T>
class [[nodiscard]] Good : public Base<T> {
 public:
  Good() : number_{1}, text_("{") {}

 private:
  class Inner {};
  int number_;
  std::string text_;
};

/// Thread safety and real-time: as Good.
class Better : public Good<int> {};

class Declared;

struct Options {};

namespace detail {

class Hidden {};

}  // namespace detail
}  // namespace takt
""".replace("`news { of } {`", "`{ of } {`"),
    "base/good_test.cpp": SPDX + "class Fixture {};\n\n" + function("sixty", 60),
    "docs/good.md": """# A page: `code`, and *more*

[here](#a-page-code-and-more), [there](sub/other.md#again-1), [a folder](sub), [far](https://x.y#z)

Questions: Who reads this? The two can be told apart; tell the thread to stop.

    [](const int& number) { use(number); }

```
[no](link)
```
""",
    "docs/sub/other.md": "# Again\n\n## Again\n\n[back](../good.md)\n",
}


def test_rules():
    accepted("a good tree is accepted", GOOD)
    refused("a long file", {"a.py": "# SPDX-License-Identifier: Apache-2.0\n" * 501},
            "a.py:501: 501 lines, 500 at most")
    refused("a long function, in a class too",
            {"tools/a.cpp": SPDX + function("f", 61) + "class A {\n public:\n" +
             "".join("  " + line + "\n" for line in function("g", 62).splitlines()) + "};\n"},
            "tools/a.cpp:2: f has 61 lines, 60 at most",
            "tools/a.cpp:65: g has 62 lines, 60 at most")
    refused("a long test", {"tools/a.cpp": SPDX + "TEST(Timer, Keeps) {\n" + "  work();\n" * 60 + "}\n"},
            "tools/a.cpp:2: TEST(Timer, Keeps) has 62 lines, 60 at most")
    refused("a long function in Python",
            {"a.py": "# SPDX-License-Identifier: Apache-2.0\ndef f():\n" + "    pass\n" * 60},
            "a.py:2: f has 61 lines, 60 at most")
    for path in ("a.cpp", "a.hpp", "a.c", "a.py", "a.sh", "a.cmake", "sub/CMakeLists.txt", "dev"):
        refused(f"no SPDX line in {path}", {path: "// A test. SPDX-License-Identifier: Apache-2.0\n" if path == "a.cpp" else "\n"},
                f"{path}:1: no line 'SPDX-License-Identifier: Apache-2.0'")
    refused("a public class without its contract",
            {"base/a.hpp": SPDX + "\nnamespace TAKT_PUBLIC takt {\n\n/// A.\n/// Real-time: yes.\nclass A {};\n\n"
             "class B {};\n\n}  // namespace takt\n"},
            "base/a.hpp:7: the comment of A has no 'Thread safety:'",
            "base/a.hpp:9: the comment of B has no 'Thread safety:' and no 'Real-time:'")
    a_class = SPDX + "class A {};\n"
    accepted("a class that is not installed has none",
             {"tools/a.hpp": a_class, "base/own.hpp": SPDX + "namespace takt {\n\nclass A {};\n\n"
              "}  // namespace takt\n"})
    own = SPDX + "namespace takt {\n\nint c();\n\n}  // namespace takt\n"
    refused("a public header with what is not exported, or not installed",
            {"base/a.hpp": SPDX + '#include "takt/base/own.hpp"\n\nnamespace TAKT_PUBLIC takt {\n\nint a();\n\n'
             "}  // namespace takt\n\nnamespace takt {\n\nint b();\n\n}  // namespace takt\n",
             "base/own.hpp": own},
            "base/a.hpp:2: the namespace of base/own.hpp must be TAKT_PUBLIC, too",
            "base/a.hpp:10: write 'namespace TAKT_PUBLIC takt {', or move it to a header of its own")
    internal = (SPDX + '#include "takt/base/a.hpp"\n\nnamespace takt {\nnamespace TAKT_INTERNAL inner {\n\nint a();\n\n'
                "}  // namespace inner\n}  // namespace takt\n")
    refused("an internal header that includes one whose names are hidden",
            {"base/b.hpp": internal, "base/a.hpp": own},
            "base/b.hpp:2: the namespace of base/a.hpp must be TAKT_PUBLIC or TAKT_INTERNAL, too")
    accepted("an internal header that includes a public one",
             {"base/b.hpp": internal, "base/a.hpp": own.replace("namespace", "namespace TAKT_PUBLIC", 1)})
    refused("temporary files under names that others can foresee",
            {"tools/a.cpp": SPDX + 'auto a = std::filesystem::temp_directory_path();\n'
             'auto b = fmt::format("/tmp/takt_{}", getpid());\nauto c = "/tmp/roudi";\n',
             "base/a_test.cpp": SPDX + 'auto a = "/tmp/b";\n'},
            "tools/a.cpp:2: use TemporaryFolder or temporary_file(): others could foresee the name",
            "tools/a.cpp:3: use TemporaryFolder or temporary_file(): others could foresee the name")
    refused("output as other processes say it",
            {"tools/takt/a.cpp": SPDX + 'auto a = fmt::print("{}", name);\nauto b = document.dump();\n',
             "tools/takt/b.cpp": SPDX + 'auto a = fmt::print(file, "{}", 1);\n'},
            "tools/takt/a.cpp:2: use rt::print(), which escapes what other processes say",
            "tools/takt/a.cpp:3: use rt::json_text(), which takes every text")
    refused("a variable of the environment that its test does not try",
            {"base/a.cpp": SPDX + 'auto a = std::getenv("NEW");\nauto b = std::getenv("KNOWN");\nauto c = "A_B";\n',
             "base/b.cpp": SPDX + 'auto a = std::getenv(name);\nbool b = c == "TAKT_A";\nauto d = read("TAKT_B");\n',
             "tools/takt/tests/environment_test.py": SPDX.replace("//", "#") + 'VARIABLES = {"KNOWN": []}\n'},
            "base/a.cpp:2: takt reads NEW: let tools/takt/tests/environment_test.py try it",
            "base/b.cpp:4: takt reads TAKT_B: let tools/takt/tests/environment_test.py try it")


def test_foreign_input():
    refused("Python that imports what lies in the folder that it is started in",
            {"tools/a.cpp": SPDX + 'run({"/usr/bin/python3", "-c"});\nrun({"python3", "-I", "a"});\nconst char* p = "python3";\n'
             'run("python3 -m a");\nadvise("apt-get install python3");\nrun({kPython, "-I"});\nrun({kPython, path});\n',
             "cmake/a.cmake": SPDX.replace("//", "#") + "set(a ${TAKT_PYTHON} ${script})\nset(a ${TAKT_PYTHON} -I ${script})\n"},
            *(f"{place}: start Python with -I: it imports what lies in the folder that it is started in"
              for place in ("cmake/a.cmake:2", "tools/a.cpp:2", "tools/a.cpp:5", "tools/a.cpp:8")))
    refused("readers of JSON without a limit of levels",
            {"tools/a.cpp": SPDX + 'auto a = json::parse(text);\n'},
            "tools/a.cpp:2: use rt::parse_json(), which has a limit of levels, and errors for people")


def test_files():
    refused("readers of their own",
            {"tools/a.cpp": SPDX + 'std::ifstream a(path);\nstd::ifstream b("/proc/self/status");\n'},
            "tools/a.cpp:2: use RegularFile or read_text(), which end whatever the file is")
    refused("writers of their own",
            {"tools/a.cpp": SPDX + 'std::ofstream a(path);\nauto b = fopen(path, "w");\nint c = open(path, O_CREAT);\n'
                                   'command.add_option("--json", path);\n'},
            "tools/a.cpp:2: use OutputFile or write_output(), which overwrite no file of a person",
            "tools/a.cpp:3: use OutputFile or write_output(), which overwrite no file of a person",
            "tools/a.cpp:4: use OutputFile or write_output(), which overwrite no file of a person",
            "tools/a.cpp:5: use add_output(), which checks the file before the command begins")


def test_class_size():
    def header(*members):
        return {"base/a.hpp": SPDX + "\nnamespace takt {\n\nclass A {\n public:\n" + "".join(
            f"  {member}\n" for member in members) + "};\n\n}  // namespace takt\n"}
    functions = [f"int f{i}(int a = 0) const {{ return a; }}" for i in range(28)]
    fields = [f"std::map<int, int> a{i}_{{1, 2}};" for i in range(11)] + ["int b_, c_ = g(1);", "Own own_{};"]
    others = ["A(const A&) = delete;", "using B = int;", "static constexpr int kC = 1;", "struct Own {\n    int d, e;\n  };"]
    accepted("a class of 30 functions and 14 fields",
             header("A() : a0_{1, 2}, b_(1) {}", "void g();", *functions, *others, *fields))
    refused("a class that does too much", header("A() {}", "void g();", "void h();", *functions, *others, *fields),
            "base/a.hpp:5: A has 31 functions, 30 at most")
    refused("a class that has too much", header(*fields, *others, "int x_, y_;"),
            "base/a.hpp:5: A has 16 fields, 15 at most")


def test_engine():
    refused("a header of the engine that would be installed",
            {"executors/engine/a.hpp": SPDX + "\nnamespace TAKT_PUBLIC takt {\n\nint a();\n\n}  // namespace takt\n"},
            "executors/engine/a.hpp:1: the engine is private: no user includes its headers (decision 0091)")


def test_links():
    refused("links that lead nowhere",
            {"a.md": "# Page\n\n[file](b.md)\n[page](#pages) and [self](a.md#page)\n[c](c.md#no)\n",
             "c.md": "```\n# no\n```\n"},
            "a.md:3: there is no b.md",
            "a.md:4: there is no heading for #pages",
            "a.md:5: there is no heading for c.md#no")


def test_once():
    defined = SPDX + "namespace takt {\n\nstruct A {};\n\n}  // namespace takt\n"
    refused("a type that is defined twice", {"tools/a/a.hpp": defined, "tools/b/b.cpp": defined},
            "tools/b/b.cpp:4: takt::A is defined in tools/a/a.hpp, too")
    accepted("a type of one file alone", {
        "tools/a/a.hpp": defined, "tools/b/b.cpp": defined.replace("struct A {};", "namespace {\nstruct A {};\n}  // namespace")})
    accepted("an enumeration in each of two namespaces", {
        "tools/a/a.hpp": defined.replace("struct", "enum class"),
        "tools/b/b.hpp": defined.replace("struct", "enum class").replace("namespace takt", "namespace other")})


def test_keep():
    refused("a created entity that may be dropped at once",
            {"base/a.hpp": SPDX + "\nnamespace TAKT_PUBLIC takt {\n\nstd::shared_ptr<Timer> create_timer(int period);\n"
             "[[nodiscard]] std::shared_ptr<Timer> create_other(int period);\n\n}  // namespace takt\n"},
            "base/a.hpp:5: write [[nodiscard]]: std::shared_ptr<Timer> create_timer(…")


def test_time_sums():
    refused("plain sums of a time and a duration",
            {"base/a.cpp": SPDX + "auto a = clock.now() + kLimit;\n"
                                  "auto b = now + 1s;\n"
                                  "auto c = goal.ended + options.result_timeout;\n"
                                  "auto d = later(clock.now(), options.timeout);\n"
                                  "auto e = kLimit + std::chrono::steady_clock::now() + kLimit;\n"
                                  "// now() + timeout\n"
                                  "next += period_;\n",
             "analysis/a.cpp": SPDX + "auto a = start + period;\n"},
            "base/a.cpp:2: 'now() +': later(time, duration) cannot overflow",
            "base/a.cpp:3: 'now +': later(time, duration) cannot overflow",
            "base/a.cpp:4: '+ options.result_timeout;': later(time, duration) cannot overflow",
            "base/a.cpp:8: '+= period_;': later(time, duration) cannot overflow")
    refused("a number of ns in a text",
            {"base/a.cpp": SPDX + 'auto a = fmt::format("it took {} ns", time.count());\n'
                                  'auto b = std::to_string(time.count()) + "ns";\n'
                                  'auto c = fmt::format("it took {}; {} answers", to_string(time), n);\n'},
            "base/a.cpp:2: \"it took {} ns…: to_string(time) writes its unit",
            "base/a.cpp:3: + \"ns…: to_string(time) writes its unit")


def test_unsound():
    refused("a last pointer for a comparison, and a static object on the heap",
            {"base/a.cpp": SPDX + "if (weak.lock() == node) return;\n"
                                  "if (weak.lock() != nullptr) return;\n"
                                  "static Topics& topics = *new Topics;\n"
                                  "static auto& lists = *new std::array<List, 3>;\n"
                                  "std::vector<std::function<void()>> callbacks_;\n"
                                  "std::function<std::vector<int>()> one_;\n"},
            "base/a.cpp:2: use is_same_owner(), which makes no pointer",
            "base/a.cpp:4: use NeverDestroyed, which allocates nothing",
            "base/a.cpp:5: use NeverDestroyed, which allocates nothing",
            "base/a.cpp:6: use CallbackList, which calls nothing that was removed")


def test_unknown_waits():
    waits = (SPDX + "void f() {\n  changed_.wait(seen);\n  set.wait(timeout);\n"
             "  // Waits for our own thread, which runs nothing of others.\n  ended_.wait(false);\n}\n")
    refused("a wait that is not known", {"nodes/a.cpp": waits},
            "nodes/a.cpp:3: use WaitInCallback, which ends waits for each other, or say above why none can be: // Waits for ...")
    accepted("what no thread of a user is in", {"sched/a.cpp": waits})


def test_clocks():
    refused("an entity with a clock that may be simulated",
            {"nodes/a.cpp": SPDX + "auto a = make_timer(clock(), name);\nauto b = Client(clock(), name);\n"
                                   "auto c = std::make_shared<TaskRunner>(name, clock(), 1);\nauto d = Client(clock().real());\n"},
            "nodes/a.cpp:3: give it clock().real(): only timers and coroutines take a time that may be simulated, see decision 0134")


def test_waiting():
    loops = (SPDX + "void f() {\n  while (!a) std::this_thread::yield();\n  while (b() != 1) {\n  }\n"
             "  while (c < (d + 1)) {\n    usleep(1);\n  }\n"
             "  while (!a && Clock::steady().now() < limit) {\n  }\n  while (take(a)) {\n  }\n"
             "  for (int i = 0; i < 100 && !a; ++i) usleep(1);\n"
             "  while (!a) {\n    usleep(1);\n    b();\n  }\n}\n")
    refused("a test that may wait for ever", {"base/a_test.cpp": loops},
            *(f"base/a_test.cpp:{line}: a test may hang here: use eventually()" for line in (3, 4, 6)))
    accepted("what is no test", {"base/a.cpp": loops})
    spdx = "# SPDX-License-Identifier: Apache-2.0\n"
    refused("a test in Python that may, too",
            {"tools/a_test.py": spdx + "while not a():\n    time.sleep(1)\nwhile a() is None:\n    pass\n"
             "while time.monotonic() < end:\n    time.sleep(1)\nwhile unmount() == 0:\n    pass\n"},
            *(f"tools/a_test.py:{line}: a test may hang here: use checks.eventually()" for line in (2, 4)))


def test_phrases():
    refused("retired phrases, also over the end of a line",
            {"a.cpp": SPDX + "// The listener is\n// told of it.\n"
             'const char* text =\n    "a thread for "\n    "who waits";\nint news;\n',
             "b.md": "Tells of\nmisses. Who sleeps\nis woken: those who\nsleep.\n"},
            "a.cpp:2: 'is told': is notified, is reported",
            "a.cpp:5: 'for who': name it: the thread that",
            "a.cpp:7: 'news': events",
            "b.md:1: 'Tells of': reports",
            "b.md:2: 'Who': name it: the thread that, which",
            "b.md:3: 'those who': those that, all that")


def test_generated():
    refused("a page that a program has drawn", {"docs/a.html": "<html>\n"}, "docs/a.html:1: write it into build/")


def test_one_list():
    refused("a second list of what is missing", {"docs/a.md": "# A\n\nKeys are not implemented.\n"},
            "docs/a.md:3: say it in docs/explanation/goals.md, and link to it")


def test_limits():
    refused("a limit that says nothing", {"base/a.cpp": SPDX + "constexpr int kMost = 3;\n"},
            "base/a.cpp:2: write above kMost: // Limit: what it bounds. At it: what happens. Seen: a counter.")
    marked = SPDX + "// Limit: messages. At it: the oldest goes. Seen: `dropped`.\nconstexpr int kMost = 3;\n"
    accepted("a limit with its marker", {"base/a.cpp": marked})
    refused("a page of limits that has others", {"base/a.cpp": marked, "docs/reference/limits.md": "# Limits\n"},
            "docs/reference/limits.md:1: not what the markers give: tools/check/limits.py > docs/reference/limits.md")


def test_format():
    refused("a file that clang-format would change", {"a.cpp": SPDX + "int  a;\nint  b;\n"},
            "a.cpp:2: not as clang-format has it: ./dev format")


def test_subjects():
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["git", "init", "-q"], cwd=folder, check=True)
        for subject in "a" * 73, "b" * 72, "c" * 73:
            subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", "commit", "-q", "--allow-empty",
                            "-m", subject], cwd=folder, check=True)
        for since, status in ("HEAD~2", 1), ("HEAD~1", 1), ("HEAD", 0), ("not_in_this_clone", 0):
            done = subprocess.run([HERE / "check.py", "--root", folder, "--since", since], text=True, check=False,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            check(f"subjects since {since}", done.returncode == status and "bbb" not in done.stdout and
                  ("73 characters: ccc" in done.stdout) == (status == 1), done.returncode, done.stdout)


def test_exceptions():
    long = {"a.py": "# SPDX-License-Identifier: Apache-2.0\n" * 510}
    accepted("what is an exception is accepted", long, exceptions="a.py file-length 10\n")
    refused("an exception that grows", long,
            "a.py:501: 510 lines, 500 at most",
            "a.py:1: file-length: 10, and the exceptions allow 9", exceptions="a.py file-length 9\n")
    refused("an exception that is too large", long,
            "a.py:1: file-length: 10, and the exceptions allow 11 still: ./dev check --update",
            exceptions="a.py file-length 11\n")
    status, said, _ = run(GOOD, exceptions="gone.py file-length 11\n")
    check("an exception for nothing", status == 1 and "gone.py:1: file-length: 0, and the exceptions "
          "allow 11 still" in said, status, said)
    status, said, _ = run(GOOD, exceptions="# a comment\na.py long 3\n")
    check("an exception that means nothing",
          status == 1 and "exceptions.txt:2: write: PATH RULE NUMBER" in said, status, said)
    status, said, now = run(long, "--update", exceptions="moved.py file-length 12\n")
    check("--update follows what has moved, and lowers",
          status == 0 and now.endswith("\na.py  file-length       10\n") and "moved.py" not in now, said, now)
    status, said, now = run(long, "--update", exceptions="moved.py file-length 9\n")
    check("--update lets no sum grow", status == 1 and now == "moved.py file-length 9\n" and
          "file-length: 10 found, and the exceptions allow 9" in said, said, now)


# The completion of zsh and fish was tried on no fresh machine.
def test_skipped_for_a_package():
    text = (HERE.parents[1] / "dev").read_text(encoding="utf-8")
    installed = set(" ".join(re.findall(r'(?m)^(?:clang_|test_)?packages="([^"]*)"', text)).split())
    listed = subprocess.run(["git", "ls-files", "*.py", "*.sh", "*.cpp"], cwd=HERE.parents[1], text=True, check=True,
                            stdout=subprocess.PIPE).stdout.split()
    asked = {}
    for path in set(listed) - {"tools/check/check_test.py"}:
        for found in re.finditer(r"skip.*\(apt-get install ([^)]+)\)", (HERE.parents[1] / path).read_text(encoding="utf-8")):
            asked |= {package: path for package in found[1].replace("{shell}", "bash zsh fish").split()}
    check("some tests are skipped without a package", {"zsh", "tmux", "iceoryx"} <= set(asked), asked)
    without = {package: path for package, path in asked.items() if package not in installed | {"bash"}}
    check("./dev test installs what a test would be skipped without", not without, without)


# It went on for minutes, and the next run waited for it.
def test_ci_ends_what_it_began():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / ".ci").mkdir()
        shutil.copy(HERE.parents[1] / ".ci/run", root / ".ci/run")
        for name, text in (("cmake", 'mkdir -p "$4/bin"; ln -s /bin/true "$4/bin/takt"'), ("dev", """case $1 in
  demo) mkdir -p build/release; touch build/release/build.ninja ;;
  build) echo $$ >new; mv new builds; sleep 300 ;;
  test) while [ ! -e builds ]; do sleep 0.01; done; exit 3 ;;
esac""")):
            (root / name).write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
            (root / name).chmod(0o755)
        done = subprocess.run(["bash", root / ".ci/run"], env=os.environ | {"PATH": f"{root}:{os.environ['PATH']}"}, check=False,
                              timeout=60)
        group = (root / "builds").read_text().strip()
        check("CI fails as its test does", done.returncode == 3, done.returncode)
        check("its build in the background ends with it",
              eventually(lambda: not os.path.exists(f"/proc/{group}")), group)


if not shutil.which("clang-format"):
    skip("there is no clang-format (apt-get install clang-format)")
test_rules()
test_foreign_input()
test_files()
test_class_size()
test_engine()
test_links()
test_once()
test_keep()
test_time_sums()
test_unsound()
test_unknown_waits()
test_clocks()
test_waiting()
test_phrases()
test_generated()
test_one_list()
test_limits()
test_format()
test_subjects()
test_exceptions()
test_skipped_for_a_package()
test_ci_ends_what_it_began()
finish()
