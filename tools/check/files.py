"""How the product may open files and print: see base/temporary.hpp, base/regular_file.hpp and
measuring/output.hpp.
SPDX-License-Identifier: Apache-2.0
"""
import pathlib
import re

NOT_PRODUCT = {"bench", "examples", "rt_tests", "testing"}
# A name that can be foreseen may be another user's link.
TEMPORARY = re.compile(r'temp_directory_path|"/tmp/|\b(?:tmpnam|tempnam|mktemp|tmpfile)\(')
# Iceoryx chooses these names.
NAMES_OF_ROUDI = re.compile(r'"/tmp/(?:roudi|iox-|\.takt_roudi_)')

# Neither has a limit of levels, and people read what the first one throws.
PARSES = re.compile(r"json::(?:parse|sax_parse)\(")
PARSERS = {"measuring/json_text.cpp", "containers/configuration/json_document.cpp"}

# Both would pass on what another process says as it is; the second also throws.
PRINTS = re.compile(r"\bfmt::print\((?!file\b)")
DUMPS = re.compile(r"\.dump\(")

# What another program has put there is input, and tested as such.
VARIABLE = re.compile(r'\b(?:getenv|envname)\("(\w+)"\)')
READS_VARIABLES = re.compile(r"\bgetenv\([^\")]")  # of names that stand elsewhere in the file
NAME = re.compile(r'(?<!== )"([A-Z][A-Z0-9]*_[A-Z0-9_]+)"')
TEST_OF_ENVIRONMENT = "tools/takt/tests/environment_test.py"

# A FIFO would hold it up, and /dev/zero fill the memory.
READS = re.compile(r'std::ifstream\b|\bfopen\([^;]*"r|\bBIO_new_file\(')
READS_OF_THE_KERNEL = re.compile(r'ifstream[^;]*"/(?:proc|sys)/')
# These read what the kernel, or takt itself, has written; the last one is given checked files.
READERS = {"containers/measured_usage.cpp", "containers/process_usage.cpp", "measuring/machine.cpp",
           "tools/takt/bench/measure.cpp", "tools/takt/commands/selftest.cpp",
           "transport/shared_memory/roudi_process.cpp", "transport/shared_memory/shared_memory.cpp",
           "transport/dds/dds_security.cpp"}

# Without -I, Python imports first what lies in the folder that it is started in, which may be another user's.
PYTHON = re.compile(r"""(?: (?<![=]\ )"(?:[^"\s]*/)?python3?" | \bkPython\b(?!\ =) | \$\{(?:TAKT_PYTHON|Python3?_EXECUTABLE)\} )
                        (?! ,?\s*"?-I\b )
                      | \bpython3?\ +(?!-I\b)(?:-[cm]\b|[\w./$-]*\.py\b)""", re.VERBOSE)
STARTS_PYTHON = {".cpp", ".hpp", ".c", ".h", ".cmake", ".in", ".sh", ".txt"}
# What is written so may be a file of a person, or one that the same command reads.
WRITES = re.compile(r'std::ofstream\b|\bfopen\([^;]*"[wa]|\bO_CREAT\b')
WRITING = ("tools/", "measuring/", "recording/", "components/", "containers/", "rt_tests/", "programs/", "rclcpp/src/")
# A template is a new file, which it never overwrites.
WRITERS = {"programs/template.cpp"}
# Nor is what such an option names checked.
OUTPUTS = re.compile(r'add_option\(\s*"(?:--json|--csv|--report|--trace|--histfile|--save|-o,--output)"')

# (what is written, why not)
UNSOUND = [
    # The pointer that it makes may be the last one: then the object ends here, perhaps under a lock.
    (re.compile(r"\.lock\(\) [=!]= (?!nullptr\b)"), "use is_same_owner(), which makes no pointer"),
    (re.compile(r"\bstatic [^;=]*= \*new\b"), "use NeverDestroyed, which allocates nothing"),
    (re.compile(r"\b(?:vector|list|deque|set|map)<[^;]*\bstd::function<"), "use CallbackList, which calls nothing that was removed"),
]


def is_product(path):
    parts = pathlib.PurePath(path).parts
    return (pathlib.PurePath(path).suffix in {".cpp", ".hpp", ".c", ".h"}
            and parts[0] not in NOT_PRODUCT and "tests" not in parts
            and "_test." not in parts[-1] and not parts[-1].startswith("test_"))


def temporary_names(path, lines):
    """(line number, what is wrong)"""
    if not is_product(path) or path == "base/temporary.cpp":
        return
    for number, line in enumerate(lines, 1):
        if TEMPORARY.search(NAMES_OF_ROUDI.sub("", line)):
            yield number, "use TemporaryFolder or temporary_file(): others could foresee the name"


def raw_output(path, lines):
    """(line number, what is wrong)"""
    if not is_product(path) or not path.startswith("tools/takt/"):
        return
    for number, line in enumerate(lines, 1):
        if PRINTS.search(line):
            yield number, "use rt::print(), which escapes what other processes say"
        if DUMPS.search(line):
            yield number, "use rt::json_text(), which takes every text"


def unsound(path, lines):
    """(line number, what is wrong)"""
    if not is_product(path):
        return
    for number, line in enumerate(lines, 1):
        for pattern, why in UNSOUND:
            if pattern.search(line):
                yield number, why


# Threads that run users' code wait for each other here.
WAITING_MODULES = ("entities/", "nodes/", "ros2/", "programs/", "rclcpp/src/", "rclcpp/include/")
WAITS = re.compile(r"[.>]wait\((?!time|0, |std::chrono)")


def unknown_waits(path, lines):
    """(line number, what is wrong)"""
    if not is_product(path) or not path.startswith(WAITING_MODULES) or path == "entities/wait_in_callback.hpp":
        return
    for number, line in enumerate(lines, 1):
        if WAITS.search(line) and "// Waits for" not in "\n".join(lines[max(0, number - 3):number]):
            yield number, "use WaitInCallback, which ends waits for each other, or say above why none can be: // Waits for ..."


# Of an argument; a timer and a coroutine go by the timeline of a node's clock, which may be simulated.
CLOCKS = re.compile(r"(?<!make_timer\()(?<![.>])\bclock\(\)(?=[,)])")


def clocks(path, lines):
    """(line number, what is wrong)"""
    if not is_product(path) or not path.startswith("nodes/"):
        return
    for number, line in enumerate(lines, 1):
        if CLOCKS.search(line) and "TaskRunner>(" not in "".join(lines[max(0, number - 2):number]):
            yield number, "give it clock().real(): only timers and coroutines take a time that may be simulated, see decision 0134"


def interpreters(path, text):
    """(line number, what is wrong)"""
    parts = pathlib.PurePath(path).parts
    if pathlib.PurePath(path).suffix not in STARTS_PYTHON or parts[0] in NOT_PRODUCT or "tests" in parts or "_test." in parts[-1]:
        return
    for found in PYTHON.finditer(text):
        yield text.count("\n", 0, found.start()) + 1, "start Python with -I: it imports what lies in the folder that it is started in"


def readers(path, lines):
    """(line number, what is wrong)"""
    if not is_product(path) or path in READERS:
        return
    for number, line in enumerate(lines, 1):
        if READS.search(line) and not READS_OF_THE_KERNEL.search(line):
            yield number, "use RegularFile or read_text(), which end whatever the file is"
        if PARSES.search(line) and path not in PARSERS:
            yield number, "use rt::parse_json(), which has a limit of levels, and errors for people"


def writers(path, lines):
    """(line number, what is wrong)"""
    if not is_product(path) or not path.startswith(WRITING) or path in WRITERS:
        return
    for number, line in enumerate(lines, 1):
        if WRITES.search(line):
            yield number, "use OutputFile or write_output(), which overwrite no file of a person"
        if OUTPUTS.search(line):
            yield number, "use add_output(), which checks the file before the command begins"


def variables(path, lines, test):
    """(line number, what is wrong); `test`: the text of that of the environment."""
    # No program of takt's has the layer for rclcpp; its own tests try what that reads.
    if not is_product(path) or path.startswith(("executors/conformance/", "executors/sequences/", "programs/", "rclcpp/")):
        return
    pattern = NAME if any(READS_VARIABLES.search(line) for line in lines) else VARIABLE
    for number, line in enumerate(lines, 1):
        for name in pattern.findall(line):
            if f'"{name}"' not in test:
                yield number, f"takt reads {name}: let {TEST_OF_ENVIRONMENT} try it"
