# SPDX-License-Identifier: MIT
"""Objects that are no plugins, or broken ones: one clear sentence each, and exit status 2."""
import json
import os
import shutil
import tempfile

import lab
from workshop import PLUGINS, SANITIZED, SOURCE, compile, quern, source

MAJOR, MINOR = lab.interface()
LINEAR = "dem/contact.linear.c"
SCENE = str(SOURCE / "configs/two_grains.yaml")


def one_sentence(text, *expected):
    lines = [line for line in text.splitlines() if "error:" in line]
    assert len(lines) == 1, f"{len(lines)} sentences, not one:\n{text}"
    for part in expected:
        assert part in lines[0], f"'{part}' is not in\n{lines[0]}"


def refused(text, name, folder, *expected, link=(), status=2):
    """A library from C text is refused by check and describe alike."""
    path = compile(text, name, folder, *link)
    if status == 0:
        quern("describe", path, status=0)
        return path
    for command in ("check", "describe"):
        one_sentence(quern(command, path, status=2), path, *expected)
    return path


MEMBERS = {"size": "sizeof(quern_library)", "abi": "QUERN_ABI", "real_size": "sizeof(quern_real)",
           "lanes": "QUERN_LANES", "param_size": "sizeof(quern_param)", "use_size": "sizeof(quern_use)",
           "name": '"x"', "version": '"1"', "license": '"MIT"', "build": '"x"', "plugin": "&plugin"}
ROW = '.name = "a", .unit = "m", .doc = "A.", .type = QUERN_T_REAL'
USE = '.field = "contact.a", .unit = "m", .doc = "A.", .access = QUERN_READ, .shape = QUERN_SCALAR'
FORCE = "static void force(const void *s, const quern_contact_batch *b) { (void)s, (void)b; }\n"


def library(rows="", uses="", ops=".force = { force, force }", more="", head="", kind="contact", table="", **changes):
    """A library's table with nothing in it but what is given; `table`: C in front of the ops."""
    members = ", ".join(f".{key} = {value}" for key, value in {**MEMBERS, **changes}.items() if value)
    table = table or FORCE
    sizes = {"solver": "QUERN_SOLVER_SIZES", "observer": ".size = sizeof ops, .output_size = sizeof(quern_output)"}
    return (f"#include <quern/{kind}.h>\n#include <quern/contact.h>\n#include <math.h>\n#include <stdlib.h>\n#include <unistd.h>\n"
            f"{head}\nstatic const quern_param params[] = {{ {rows} QUERN_END_PARAMS }};\n"
            f"static const quern_use uses[] = {{ {uses} QUERN_END_USES }};\n{table}"
            f"static const quern_{kind}_ops ops = {{ {sizes.get(kind, '.size = sizeof ops')}, {ops} }};\n"
            f"static const quern_plugin plugin = {{ .size = sizeof plugin, .dims = 3,\n"
            f'\t.id = "{kind}.bad", .instance_size = 64, .params = params, .uses = uses, .ops = &ops, {more} }};\n'
            "QUERN_EXPORT extern const quern_library quern_library_2;\n"
            f"const quern_library quern_library_2 = {{ {members} }};\n"
            "QUERN_EXPORT const void *used(void);\nconst void *used(void) { return &plugin; }\n")


def check_interfaces(folder):
    refused(library(abi="3u << 16"), "contact.bad", folder, f"is built for interface 3.0, this program speaks {MAJOR}.{MINOR}",
            "rebuild")
    refused(library(abi="QUERN_ABI + 1"), "contact.bad", folder, f"is built for interface {MAJOR}.{MINOR + 1}, this program speaks {MAJOR}.{MINOR}")
    refused(library(size="8"), "contact.bad", folder, "is built for interface")
    refused(library(real_size="4"), "contact.bad", folder, "is built for another number format")
    refused(library(plugin="0"), "contact.bad", folder, "describes no plugin")
    refused("int quern_library_2 = 1; const char *name = \"x\";", "contact.bad", folder, "exports no quern_library_2",
            "QUERN_LIBRARY")
    newer = "__attribute__((visibility(\"default\"))) extern const int quern_library_3; const int quern_library_3 = 1;"
    refused(newer, "contact.bad", folder, "is built for interface 3, this program speaks 2")
    refused(newer.replace("_3", "_1"), "contact.bad", folder, "is built for interface 1, this program speaks 2")
    refused(source(LINEAR, ('.id = "contact.linear"', '.id = "linear"')), "contact.linear", folder,
            "has an id that is not KIND.NAME, two words")
    print("wrong interfaces, sizes, symbols and kinds are refused")


MAP = "static void map(const void *s, const quern_observer_batch *b, quern_real *p) { (void)s, (void)b, *p = 0; }\n"
RUN = "static quern_status go(const void *s, const quern_step *p) { return (void)s, (void)p, QUERN_OK; }\n" \
      "static const quern_set sets[] = { { .name = \"%s\", .doc = \"S.\", .slot = %s }, { .name = 0 } };\n" \
      "static const quern_slot slots[] = { { .name = \"a\", .doc = \"S.\", .kind = &quern_contact_kind, " \
      ".stage = { \"bad.go\" }, %s }, { .name = 0 } };\n" \
      "static const quern_stage stages[] = { { .name = \"bad.go\", .doc = \"S.\", .uses = uses, .run = go, %s }, " \
      "{ .name = 0 } };\n"


def solver(set_name="s", set_slot="0", slot="", stage=""):
    return library(kind="solver", table=RUN % (set_name, set_slot, slot, stage),
                   ops=".sets = sets, .slots = slots, .stages = stages")


def observer(outputs, ops='.set = "grain", .map = map'):
    return library(kind="observer", table=MAP + f"static const quern_output outputs[] = {{ {outputs} }};\n",
                   ops=f".outputs = outputs, {ops}")


def starter(takes, **changes):
    """A solver that starts from another run's state, of these sets."""
    row = 'static const char *const takes[] = { %s 0 }, *const needed[] = { "s.a", 0 };\n' % takes
    text = solver(**changes).replace("static const quern_solver_ops", row + "static const quern_solver_ops")
    named = '{ .name = "from", .doc = "F.", .type = QUERN_T_TEXT, .flags = QUERN_FILE }, QUERN_END_PARAMS'
    return text.replace(".stages = stages", '.stages = stages, .from = "from", .takes = takes, .essential = needed').replace(
        "QUERN_END_PARAMS", named, 1)


ENDLESS = f"[0 ... 1999] = {{ {ROW} }},"
LIST = '{ .name = "l", .doc = "L.", .type = QUERN_T_LIST, .item_size = 16, .rows = %s },'
OUTPUT = '{ .name = "%s", .unit = "1", .doc = "O." }, { .name = 0 }'
# what is wrong with a table, and what the one sentence about it says
LAW = "static void law(const quern_check *c) { (void)c; }\nQUERN_KIND(%s, quern_check_ops, \"K.\", QUERN_END_FUNCTIONS);\n"
TESTED = ".kind = &quern_%s_kind, .law = law"
TABLES = [
    (library(rows=ENDLESS), "more than 256 parameters, so the last row is no QUERN_END_PARAMS"),
    (library(rows=f"{{ {ROW}, .offset = 1000000 }},"), "'a' lies at bytes 1000000 to 1000008 of 64"),
    (library(rows=f"{{ {ROW}, .offset = 2000000000 }},"), "lies at bytes 2000000000 to"),
    (library(rows=f"{{ {ROW}, .offset = 0xfffffff8 }},"), "lies at bytes 4294967288 to 4294967296 of 64"),
    (library(rows=f"{{ {ROW}, .offset = 60 }},"), "lies at bytes 60 to 68 of 64"),
    (library(rows=f"{{ {ROW}, .offset = 4 }},"), "lies at byte 4, where its type cannot"),
    (library(rows=f"{{ {ROW}, .type = 77 }},"), "'a' has the unknown type 77"),
    (library(rows=f"{{ {ROW}, .min = 1, .max = -1 }},"), "the range of 'a' is empty"),
    (library(rows=f"{{ {ROW}, .def = NAN }},"), "the default nan of 'a' is no number"),
    (library(rows=f"{{ {ROW}, .type = QUERN_T_INT, .def = 1e300 }},"), "of 'a' is no whole number"),
    (library(rows='{ .name = "a b", .type = QUERN_T_REAL },'), "'a b' is no name of a parameter"),
    (library(rows='{ .name = "a..b", .type = QUERN_T_REAL },'), "'a..b' is no name of a parameter"),
    (library(rows=f'{{ .name = "{"a" * 70}", .type = QUERN_T_REAL }},'), "aaa' is no name of a parameter"),
    (library(rows=f"{{ {ROW}, .unit = \"m\\001\" }},"), "unit, doc, text or from of 'a' is no plain text"),
    (library(rows=f"{{ {ROW}, .from = \"nowhere to\" }},"), "unit, doc, text or from of 'a' is no plain text"),
    (library(rows=f"{{ {ROW}, .choices = words }},", head='static const char *const words[] = { "x", 0 };'),
     "'a' has choices, so its type must be int32_t"),
    (library(rows=f"{{ {ROW}, .type = QUERN_T_INT, .choices = words, .def = 5 }},",
             head='static const char *const words[] = { "x", "y", 0 };'), "the default 5 of 'a' is none of its 2 choices"),
    (library(rows=f"{{ {ROW}, .type = QUERN_T_INT, .choices = words }},",
             head='static const char *const words[100] = { [0 ... 99] = "x" };'), "must be 1 to 64, then NULL"),
    (library(rows=f"{{ {ROW}, .type = QUERN_T_INT, .choices = words }},",
             head="static const char *const words[] = { 0 };"), "must be 1 to 64, then NULL"),
    (library(rows=LIST % "own", head="static const quern_param own[];\nstatic const quern_param own[] = { " +
             LIST % "own" + "QUERN_END_PARAMS };"), "nest deeper than 4, or contain themselves"),
    (library(rows=LIST.replace("16", "12") % "own", head=f"static const quern_param own[] = {{ {{ {ROW} }}, QUERN_END_PARAMS }};"),
     "items of 12 bytes of the list 'l' do not keep 'a' in line"),
    (library(rows=LIST % "0"), "the list 'l' has no rows, or items of 16 bytes"),
    (library(rows=f"{{ {ROW}, .unless = \"b c\" }},"), "unless of 'a' is no name of a parameter"),
    (library(rows=LIST.replace(".rows", '.text = "a", .rows') % "own", head=f"static const quern_param own[] = {{ {{ {ROW} }}, QUERN_END_PARAMS }};"),
     "'a', which shall take the keys of the list 'l', is no text of its items"),
    (library(rows=f"{{ {ROW}, .rows = own }},", head="static const quern_param own[] = { QUERN_END_PARAMS };"),
     "'a' has rows, so its type must be quern_list"),
    (library(param_size="0"), "rows of 0 and 64 bytes"), (library(param_size="1"), "rows of 1 and 64 bytes"),
    (library(param_size="1u << 30"), "rows of 1073741824 and 64 bytes"),
    (library(use_size="0"), "rows of 112 and 0 bytes"), (library(use_size="63"), "rows of 112 and 63 bytes"),
    (library(uses=f"[0 ... 39] = {{ {USE} }},"), "more than 32 uses"),
    (library(uses=f"[0 ... 999] = {{ {USE} }},"), "more than 32 uses"),
    (library(uses=f'{{ {USE}, .field = "slip" }},'), "'slip' is no SET.NAME"),
    (library(uses=f'{{ {USE}, .field = "a.b.c" }},'), "'a.b.c' is no SET.NAME"),
    (library(uses=f"{{ {USE}, .shape = 9 }},"), "access, shape, hook or flags of contact.a are unknown"),
    (library(uses=f"{{ {USE}, .access = 0 }},"), "access, shape, hook or flags of contact.a are unknown"),
    (library(uses=f"{{ {USE}, .hook = 3 }},"), "access, shape, hook or flags of contact.a are unknown"),
    (library(uses=f"{{ {USE}, .rule = 5 }},"), "the rule of contact.a is unknown, or asks for sums of what is no number"),
    (library(uses=f"{{ {USE}, .access = QUERN_READ, .rule = QUERN_OWN }},"), "a rule is for who changes the field: contact.a is read"),
    (library(uses=f"{{ {USE}, .shape = QUERN_INDEX, .rule = QUERN_MEANS }},"), "asks for sums of what is no number"),
    (library(uses=f'{{ {USE}, .when = "b" }},'), "contact.a hangs on 'b', which is no parameter"),
    (library(uses=f'{{ {USE}, .with = "b" }},'), "contact.a goes with 'b', which is no SET.NAME"),
    (library(uses=f'{{ {USE}, .target = "grain" }},'), "only an index has a target"),
    (library(ops=".force = { force }"), "ops lacks the function force for 3-D, which dims promises"),
    (library(ops=".force = { 0, force }"), "ops lacks the function force for 2-D, which dims promises"),
    (library(ops=".force = { force, force }, .size = 0"), "ops has the size 0: set .size = sizeof ops"),
    (library(ops=".force = { force, force }, .size = 1000000"), "ops has the size 1000000"),
    (library(ops=".force = { force, force }, .size = 8"), "ops lacks the function force for 2-D"),
    (library(more=".dims = 0"), "dims is 0, must be"), (library(more=".dims = 7"), "dims is 7, must be"),
    (library(more=".instance_size = 0"), "instance_size is 0, must be 1 to 16777216"),
    (library(more=".instance_size = 2000000000"), "instance_size is 2000000000"),
    (library(more='.id = "contact"'), "has an id that is not KIND.NAME, two words"),
    (library(more='.id = "contact."'), "has an id that is not KIND.NAME"),
    (library(more='.id = "contact.b d"'), "has an id that is not KIND.NAME"),
    (library(more='.brief = "a\\033[2J"'), "brief, doc or cite is no plain text"),
    (library(version='"1\\a"'), "name, version, license or build of the library is no plain text"),
    (observer("{ .name = 0 }"), "an observer without outputs"),
    (observer(OUTPUT % "a b"), "output 'a b' has a name that is no word"),
    (observer('[0 ... 999] = { .name = "o", .unit = "1" }'), "more than 256 outputs"),
    (observer(OUTPUT % "o", ".map = map"), "ops has map, with the set that it runs over, or whole"),
    (observer(OUTPUT % "o", ""), "ops has map, with the set that it runs over, or whole"),
    (solver(set_name="a name"), "set 'a name': a word of at most 23 letters"),
    (solver(set_slot='"b"'), "set s hangs on the slot 'b', and there is none"),
    (solver(set_slot='0, .when = "b"'), "set s hangs on the parameter 'b', and there is none"),
    (solver(stage='.when = "a"'), "stage bad.go: the first one hangs on no parameter"),
    (solver(slot='.kind = &quern_solver_kind'), "slot a: a solver sits in no slot"),
    (solver(slot='.kind = 0'), "slot a: there is no kind; use QUERN_KIND"),
    (solver(slot='.repeat = "s"'), "slot a: repeat and again are a pair of sets"),
    (solver(stage=".flags = 99"), "stage bad.go: phase 0 or flags 99 are unknown"),
    (solver(stage=".flags = QUERN_SETTLES"), "stage bad.go: only what runs in QUERN_SUBSTEP settles"),
    (solver().replace("QUERN_SOLVER_SIZES", ".size = sizeof ops"), "set the sizes of ops by QUERN_SOLVER_SIZES"),
    (solver().replace(".stages = stages", ".stages = stages, .section = \"a b\""), "the section 'a b' is no word"),
    (solver().replace(".stages = stages", ".stages = stages, .account = (void (*)(const void *, const quern_step *, "
                      "quern_real *))go"), "sums and account go together"),
    (solver(slot='.stage = { "bad.come" }'), "slot a: there is no stage 'bad.come'"),
    (solver(slot='.name = "l.a"'), "slot l.a: there is no such list among the parameters"),
    (solver(slot='.override = "grains"'), "slot a: it overrides 'grains', which is no SECTION.SLOT"),
    (solver(slot='.refine = "a"'), "slot a: 'a' shall refine it, and is no list among the parameters"),
    (solver(slot='.rows = params'), "slot a: rows and item_size go together"),
    (solver(stage=".run = 0"), "stage bad.go: phase 0 or flags 0 are unknown, or there is no run or no uses"),
    (solver(stage=".phase = 99"), "stage bad.go: phase 99 or flags 0 are unknown"),
    (library(kind="solver", table=RUN % ("s", "0", "", ""), ops=".sets = sets"), "a solver without stages"),
    (starter(""), "from is there, and takes or essential are not"),
    (starter('"s",').replace("QUERN_FILE", "0"), "from: 'from' is no parameter that names a file"),
    (starter('"t",'), "takes: 't' is no set of this solver that holds entries in every scene"),
    (starter('"s",', set_slot='"a"'), "takes: 's' is no set of this solver that holds entries in every scene"),
    (starter('"s",', set_slot="0, .rows = 8"), "takes: 's' is no set of this solver that holds entries in every scene"),
    (starter('"s", "t",'), "takes: 't' is no set of this solver that holds entries"),
    (library(kind="check", table=LAW % "bad", ops=".law = law"), "ops: there is no kind; use QUERN_KIND"),
    (library(kind="check", table=LAW % "good", ops=TESTED % "good"), "it checks the kind good, so its id must be check.good"),
    (library(kind="check", table=LAW % "bad", ops=".kind = &quern_bad_kind"), "ops lacks the function law"),
    (library(kind="check", table="#include <quern/solver.h>\n" + LAW % "bad", ops=TESTED % "solver"),
     "a solver has no conformance test of its kind"),
]


def check_tables(folder):
    """Nothing that a table says is believed before it was looked at, by whichever command."""
    refused(library(), "contact.bad", folder, status=0)
    refused(solver(), "solver.bad", folder, status=0)
    refused(starter('"s",'), "solver.bad", folder, status=0)
    small = "static const quern_param own[] = { { .name = \"k\", .type = QUERN_T_INT }, QUERN_END_PARAMS };"
    refused(library(rows=LIST.replace("16", "4") % "own", head=small), "contact.bad", folder, status=0)
    for text, expected in TABLES:
        name = next(kind for kind in ("observer", "solver", "check", "contact") if f'.id = "{kind}.bad"' in text) + ".bad"
        path = refused(text, name, folder, expected)
        if name == "contact.bad":
            one_sentence(quern("plan", SCENE, "--set", "grains.contact=bad", status=2, QUERN_PLUGIN_PATH=folder), path,
                         expected)
    for command in ("list", "schema"):
        assert "contact.bad.so has a faulty table: " in quern(command, status=2, QUERN_PLUGIN_PATH=folder)
    print(f"{len(TABLES)} faulty tables are refused in one sentence each")


def check_pointers(folder):
    """What reads tables without running them survives those that lead nowhere, and what a start-up code does."""
    nowhere = "(const char *)16"
    start = "__attribute__((constructor)) static void start(void) { %s }"
    cases = [(library(rows=f"{{ {ROW}, .doc = {nowhere} }},"), "crashed (SIGSEGV) while its tables were read"),
             (library(more=f".id = {nowhere}"), "crashed (SIGSEGV) while its tables were read"),
             (library(head=start % "abort();"), "crashed (SIGABRT) while it was loaded"),
             (library(head=start % "exit(0);"), "ended the program while it was loaded"),
             (library(head=start % "_exit(0);"), "ended the program while it was loaded"),
             (library(head=start % 'if (chdir("/")) abort();'), "changes the working folder when it is loaded")]
    if not SANITIZED:  # a sanitizer starts processes itself, so they cannot be forbidden
        cases += [(library(head=start % "for (;;) fork();"), "started a process while it was loaded"),
                  (library(head=start % "for (;;) vfork();"), "started a process while it was loaded"),
                  (library(head=start % 'if (system("true")) abort();'), "started a process while it was loaded")]
    for text, expected in cases:
        path = refused(text, "contact.bad", folder, expected)
        for command in ("list", "schema"):
            said = quern(command, status=2, QUERN_PLUGIN_PATH=folder)
            one_sentence(said, path, expected)
            assert "contact.linear" in said or command == "schema" and '"linear"' in said, "the others are not shown"
    for end in ["exit(0);"] + ([] if SANITIZED else ["_exit(0);"]):
        compile(library(head=start % end), "contact.bad", folder)
        said = quern("plan", SCENE, "--set", "grains.contact=bad", status=3, QUERN_PLUGIN_PATH=folder)
        one_sentence(said, "contact.bad.so ended the program in its start-up code")
    print("a plugin that crashes, ends, moves or multiplies when it is looked at is one sentence")


def check_objects(folder):
    path = os.path.join(folder, "contact.text.so")
    with open(path, "w") as file:
        file.write("this is no object\n")
    one_sentence(quern("check", path, status=2), "cannot be loaded")
    missing = source(LINEAR, ("(void)setup, (void)err;", "extern void nobody_has_this(void); nobody_has_this();"))
    refused(missing, "contact.linear", folder, "cannot be loaded", "nobody_has_this")
    one_sentence(quern("check", os.path.join(folder, "nowhere.so"), status=2), "No such file or directory")
    # the start-up code of -ffast-math flushes small numbers to zero in the whole program
    refused(source(LINEAR), "contact.linear", folder, "changes the rounding or another mode of arithmetic when it is loaded",
            "-ffast-math at its link", link=["-ffast-math"])
    print("objects that cannot be mapped, or change arithmetic, are refused")


def check_search(folder):
    own = compile(source(LINEAR), "contact.linear", folder)
    twice = quern("plan", SCENE, status=2, QUERN_PLUGIN_PATH=folder + ":" + str(PLUGINS))
    one_sentence(twice, "two_grains.yaml:", "contact.linear is offered twice", folder, "remove one")
    # the path comes before the program's own folder, which is searched whether there is a path or not
    for path, wanted in ((folder, own), ("", None), ("/nowhere", None), (folder + ":" + folder, own)):
        plan = json.loads(quern("plan", SCENE, "--json", status=0, QUERN_PLUGIN_PATH=path))
        files = {plugin["id"]: plugin["file"] for plugin in plan["plugins"]}
        assert (files["contact.linear"] == wanted) == (wanted is not None), f"{path}: {files}"
        assert files["solver.dem"].startswith(str(PLUGINS))
    assert quern("list", status=0, QUERN_PLUGIN_PATH=folder).count("contact.linear ") == 1
    os.remove(own)
    compile(source(LINEAR), "contact.springy", folder)
    wrong = quern("plan", SCENE, "--set", "grains.contact=springy", status=2, QUERN_PLUGIN_PATH=folder)
    one_sentence(wrong, "--set grains.contact=springy", "calls itself contact.linear: name the file contact.linear.so")
    assert "identity: the file is contact.springy.so, the id contact.linear" in quern(
        "check", os.path.join(folder, "contact.springy.so"), status=2)
    one_sentence(quern("plan", SCENE, "--set", "grains.contact=gimp", status=2), "'gimp' is shape.gimp",
                 "a plugin of kind contact is wanted")
    one_sentence(quern("list", status=2, QUERN_PLUGIN_PATH=folder), "calls itself contact.linear")
    os.remove(os.path.join(folder, "contact.springy.so"))
    # objects that nobody can ask for are in nobody's way
    for stray in ("contact.so", "body.so", "contact.v3.so", "contact.a-b.so"):
        shutil.copy(PLUGINS / "body.box.so", os.path.join(folder, stray))
        one_sentence(quern("list", status=2, QUERN_PLUGIN_PATH=folder), stray, "cannot be asked for by its name")
        quern("describe", "hertz", status=0, QUERN_PLUGIN_PATH=folder)
        quern("plan", SCENE, status=0, QUERN_PLUGIN_PATH=folder)
        os.remove(os.path.join(folder, stray))
    print("the search refuses duplicates and names that do not fit")


def check_good(folder):
    text = quern("check", compile(source(LINEAR), "contact.linear", folder), status=0)
    assert "contact.linear: " in text and "all ok" in text
    crash = source(LINEAR, ("static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }",
                            "static void force_2d(const void *self, const quern_contact_batch *b) "
                            "{ force(2, self, b); if (b->n == 7) *(volatile int *)0 = 1; }"))
    text = quern("check", compile(crash, "contact.linear", folder), status=2)
    assert "contact.linear: crashed (SIGSEGV) in linear.force, 2-D, while n = 7" in text, text
    print("a plugin from outside the source tree passes; one that crashes is one sentence")


if __name__ == "__main__":
    for test in (check_interfaces, check_tables, check_pointers, check_objects, check_search, check_good):
        with tempfile.TemporaryDirectory() as name:
            test(name)
