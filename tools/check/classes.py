"""How large classes are: one that does many things cannot be held in one's head.
SPDX-License-Identifier: Apache-2.0
"""
import re

import cpp_source
from waiting import is_test

MOST_FUNCTIONS = 30
MOST_FIELDS = 15

# (functions, fields) that the larger ones may have, and why. Never split one only for the number.
EXCEPTIONS = {
    ("components/recorder.hpp", "Recorder"): (18, 16, "a component, with its parameters"),
    ("containers/container.hpp", "Container"): (34, 14, "the façade of a process: 29 of them are its interface"),
    ("containers/model/model_builder.hpp", "AssumptionFinder"): (34, 0, "a step for each kind of assumption"),
    ("containers/model/model_builder.hpp", "ModelParts"): (24, 19, "what all steps share"),
    ("containers/model/model_builder.hpp", "ModelBuilder"): (42, 0, "a step for each part of a model"),
    ("entities/entity.hpp", "Entity"): (44, 14, "what executors see of every kind of entity"),
    ("executors/isolated_executor.hpp", "IsolatedExecutor"): (50, 18, "20 of them are the interface of an executor"),
    ("nodes/lifecycle_node.hpp", "LifecycleNode"): (35, 7, "the façade that rclcpp_lifecycle has"),
    ("nodes/node.hpp", "Node"): (87, 15, "the façade that rclcpp has"),
    ("nodes/parameter_store.hpp", "ParameterStore"): (37, 17, "the parameters of rclcpp's node, behind its façade"),
    ("rclcpp/include/rclcpp/detail/node_api.hpp", "NodeApi"): (64, 21, "rclcpp's interface"),
    ("rclcpp/include/rclcpp/qos.hpp", "QoS"): (36, 1, "rclcpp's interface"),
    ("transport/dds/cyclone_endpoint.hpp", "CycloneEndpoint"): (15, 16, "what Cyclone tells of an endpoint"),
    ("transport/dds/cyclone_participant.hpp", "CycloneParticipant"): (26, 16, "the façade of Cyclone"),
}

# What is neither a function nor a field of an object.
NO_MEMBER = re.compile(r"(?:using|friend|typedef|static_assert|enum|union|class|struct|template class|TAKT_\w+"
                       r"|(?:inline )?static (?:inline |constexpr |constinit |thread_local ))\b")
NESTED = [re.compile(pattern) for pattern in (r"\[\[[^\]]*\]\]", r"alignas\([^()]*\)", r"<[^<>;(){}]*>",
                                               r"\bTAKT_[A-Z_]+\((?:[^()]|\([^()]*\))*\)")]
FIELD = re.compile(r"[\w:&* \[\]]+[ &*]\w+")


def members(body):
    """The declarations in the body of a class, without what is in their braces."""
    depth = 0
    own = []
    for found in re.finditer(r"[{}]|[^{}]+", body):
        if found[0] == "{":
            depth += 1
        elif found[0] == "}":
            depth -= 1
            # A list of values does not end a declaration, a body does.
            if depth == 0 and not re.match(r"\s*[,;){]", body[found.end():]):
                own.append(";")
        elif depth == 0:
            own.append(found[0])
    text = re.sub(r"\b(?:public|private|protected):", "", "".join(own))
    for pattern in NESTED:
        while pattern.search(text):
            text = pattern.sub("", text)
    return [" ".join(each.split()) for each in text.split(";") if each.strip()]


def count(body):
    """(functions, fields) of the class with this body. No parser: nearly right is good enough."""
    functions = fields = 0
    for member in members(body):
        declared = member.split("=")[0]
        if NO_MEMBER.match(member) or re.search(r"= (?:default|delete)$", member):
            continue
        if "(" in declared or "operator" in declared:
            functions += 1
        elif FIELD.match(declared):
            fields += 1 + declared.count(",")
    return functions, fields


def sizes(text, kinds=("class",)):
    """(name, line, functions, fields) of each class."""
    lines = cpp_source.without_comments(text).split("\n")
    for kind, name, first, last, _ in cpp_source.outline(text):
        if kind in kinds:
            body = "\n".join(lines[first - 1:last])
            yield name, first, *count(body[body.index("{") + 1:body.rindex("}")])


def of_folder(files, folder):
    """What a folder's code has: lines without comments, directives and blank ones; functions that have a body; and of
    its larger classes (functions, fields)."""
    lines = functions = 0
    of_classes = {}
    for file in files:
        if not file.path.startswith(folder) or not file.path.endswith((".hpp", ".cpp")) or is_test(file.path):
            continue
        lines += sum(1 for line in cpp_source.without_comments(file.text).split("\n") if line.strip())
        functions += sum(1 for kind, *_ in cpp_source.outline(file.text) if kind == "function")
        if file.path.endswith(".hpp"):
            of_classes.update({name: counts for name, _, *counts in sizes(file.text, ("class", "struct"))})
    larger = sorted(of_classes.items(), key=lambda each: -sum(each[1]))[:8]
    return (f"{folder} {lines} lines of code, {functions} functions; classes (functions, fields): " +
            ", ".join(f"{name} ({counts[0]}, {counts[1]})" for name, counts in larger))


def too_large(path, text):
    """(line, what is wrong) of the classes of a header."""
    if not path.endswith(".hpp") or is_test(path):
        return
    for name, line, functions, fields in sizes(text):
        most_functions, most_fields, *_ = EXCEPTIONS.get((path, name), (MOST_FUNCTIONS, MOST_FIELDS))
        if functions > most_functions:
            yield line, f"{name} has {functions} functions, {most_functions} at most"
        if fields > most_fields:
            yield line, f"{name} has {fields} fields, {most_fields} at most"
        if (path, name) in EXCEPTIONS and functions <= MOST_FUNCTIONS and fields <= MOST_FIELDS:
            yield line, f"{name} needs no exception in tools/check/classes.py any more"
