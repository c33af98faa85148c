"""Phrases that were this project's own English, and the plain word for each.

A pattern must seldom be wrong: `who`, `way` and `plan` alone are good words. A space in a pattern
stands for any space, also for the end of a line within a comment or a paragraph. Capitals count
as small letters. Groups do not capture.
SPDX-License-Identifier: Apache-2.0
"""
RETIRED = [
    # "is told apart from" and "is told to stop" are English.
    (r"\b(?:is|are|was|were|be|been|being|has|have)(?: not| never| then)? told\b(?! apart| from| to\b)",
     "is notified, is reported"),
    (r"\btold (?:of|about)\b", "notified of, reported"),
    (r"\btell(?:s|ing)? of\b", "reports"),
    (r"\bnews\b", "events"),
    (r"\bjudg(?:e|es|ed|ing|ement|ment)\b", "checks"),
    (r"\blook(?:s|ed|ing)? on\b(?! page)", "observes"),
    (r"\bonlookers?\b", "observer"),
    (r"\bmend(?:s|ed|ing)?\b", "fixes"),
    (r"\bwhoever\b", "name it: the thread, the process, the owner that"),
    # Who without a noun before it: "who sleeps is woken". Questions are no such thing.
    (r"(?-i:\bWho\b)(?![^.?:;]*\?)", "name it: the thread that, which"),
    (r"\b(?:for|by|of|from|than|to|with|between|after|as|beside) who\b", "name it: the thread that"),
    (r"[:;] (?-i:who) (?!is\b|has\b|was\b|this\b)\w+s\b", "name it: the thread that"),
    (r"\bwho (?:sleeps?|waits?|publish(?:es)?|subscribes?|posts?|cancels?|announces?|joins?|comes?)\b",
     "that"),
    (r"\b(?:those|all) who\b", "those that, all that"),
    (r"\bways? of (?:a|the|each|its|this|one|that) (?:chain|message|instance)s?\b", "path"),
    (r"\b(?:chain|message)(?:'s)? ways?\b", "path"),
    (r"\bby (?:its|their) way\b", "path"),
    # A noun clause that says by a negation what something is not.
    (r"\bwhat is no (?!longer\b|more\b)", "what is not a"),
    (r"\bno std::exception\b", "not a std::exception"),
    (r"(?<!\bthere) (?:is|are) no (?:keys?|values?|entry|entries|callbacks?|parameters?|types?) of\b", "is not a ... of"),
    (r"\bat the most\b", "at most"),
    (r"\bpieces? of readiness\b", "message, release, event"),
    (r"\bso many \w+ (?:were|are) sent\b", "the number of ... that were sent"),
    (r"\b1 (?:components|executors|threads|messages|topics|chains|nodes)\b", "a plural: counted() in base/counted.hpp"),
    # `takt plan` keeps the word; the engine's is a schedule update.
    (r"\bReadyPlan\b", "schedule update"),
    (r"\binstall(?:s|ed|ing)? (?:a|an|the|that|its) plan\b", "schedule update"),
    (r"\bplan (?:is|was|has|have)(?: not)?(?: \w+)? (?:installed|handed over)\b", "schedule update"),
]
